// The panels beside the charts over time, one of them shown: loops, energy by cause, spectrum, before and after, motion.

import { BudgetPanel } from "./budget_panel.js";
import { ComparePanel } from "./compare_panel.js";
import { byId } from "./dom.js";
import { MotionPanel } from "./motion_panel.js";
import { PhasePlots } from "./phase_plots.js";
import { SpectrumChart } from "./spectrum_chart.js";

const NEXT = { ArrowRight: 1, ArrowLeft: -1 };

export class Panels {
  /** @param {import("./viewport.js").Viewport} viewport is told which panel is shown: only its numbers are sent. */
  constructor(viewport) {
    this.viewport = viewport;
    this.panels = {
      loops: new PhasePlots(byId("loop"), byId("momentum")),
      energy: new BudgetPanel(byId("budget")),
      spectrum: new SpectrumChart(byId("spectrum")),
      compare: new ComparePanel(byId("compare")),
      motion: new MotionPanel(byId("motion")),
    };
    this.tabs = [...document.querySelectorAll("[role=tab]")];
    for (const tab of this.tabs) tab.addEventListener("click", () => this.choose(tab.dataset.panel));
    byId("tabs").addEventListener("keydown", (event) => {
      const by = NEXT[event.key];
      if (!by) return;
      event.preventDefault();
      const at = this.tabs.indexOf(document.activeElement);
      const next = this.tabs[(at + by + this.tabs.length) % this.tabs.length];
      next.focus();
      this.choose(next.dataset.panel);
    });
    this.choose(viewport.panel);
  }

  choose(name) {
    for (const tab of this.tabs) {
      const isChosen = tab.dataset.panel === name;
      tab.setAttribute("aria-selected", String(isChosen));
      tab.tabIndex = isChosen ? 0 : -1;
      byId(`panel-${tab.dataset.panel}`).hidden = !isChosen;
    }
    this.viewport.choose(name);
  }

  /** Show what a snapshot has for the chosen panel. */
  show(snapshot, state) {
    this.panels[this.viewport.panel].show(snapshot, state);
  }

  /** Fit all axes closely the next time. */
  refit() {
    this.panels.loops.refit();
    this.panels.spectrum.refit();
  }
}
