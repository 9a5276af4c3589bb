// Short words for what every part of the page does to it.

/** The element with this id. */
export const byId = (id) => document.getElementById(id);

/** An element with attributes and children; text children stay text. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

/** Sets an element's text, touching it only if that changes: screen readers and layout are left in peace. */
export function put(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Shows a shape of index.html in the svg of an element, and a word beside it. */
export function sign(element, shape, word) {
  element.querySelector("use").setAttribute("href", `#${shape}`);
  put(element.querySelector("span"), word);
}
