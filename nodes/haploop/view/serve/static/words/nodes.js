// The nodes of the run: how far each one is, whom it waits for, what it had to skip.

import { programName } from "../drawing/amounts.js";
import { byId, make, put } from "../dom.js";

/** Show the table of nodes; rows are kept and only their texts change. */
export function showNodes(nodes) {
  const body = byId("nodes");
  byId("no-nodes").hidden = nodes.length > 0;
  while (body.rows.length > nodes.length) body.deleteRow(-1);
  nodes.forEach((node, i) => {
    const row = body.rows[i] ?? body.appendChild(emptyRow());
    const foreign = node.program ? `${programName(node.program)}, not haploop's own; ` : "";
    row.title = `${foreign}process ${node.pid}; ${node.lossless ? "the run waits for it" : "the run never waits for it"}`;
    row.classList.toggle("waits", Boolean(node.waits_for));
    const waits = node.waits_for ? `→ ${node.waits_for}` : "";
    const texts = [node.program ? `${node.role}: ${node.program.name || node.program.command || "no name"}` : node.role, node.tick, node.behind_ticks, waits, node.skipped_ticks ?? 0];
    texts.forEach((text, cell) => put(row.cells[cell], String(text)));
  });
}

const emptyRow = () => make("tr", {}, make("th", { scope: "row" }), ...Array.from({ length: 4 }, () => make("td")));
