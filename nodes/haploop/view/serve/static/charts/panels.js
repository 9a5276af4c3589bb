// The panels beside the charts over time, one of them shown: loops, energy by cause, spectrum, before and after, motion, own columns.

import { BudgetPanel } from "./budget_panel.js";
import { ComparePanel } from "./compare_panel.js";
import { beat, byId, seldom } from "../dom.js";
import { MotionPanel } from "./motion_panel.js";
import { OwnPanel } from "./own_panel.js";
import { PhasePlots } from "./phase_plots.js";
import { SpectrumChart } from "./spectrum_chart.js";

const LOOPS_MS = 50;
const NEXT = { ArrowRight: 1, ArrowLeft: -1 };

export class Panels {
  /** @param {import("../viewport.js").Viewport} viewport is told which panel is shown: only its numbers are sent. */
  constructor(viewport) {
    this.viewport = viewport;
    this.panels = {
      loops: new PhasePlots(byId("loop"), byId("momentum")),
      energy: new BudgetPanel(byId("budget")),
      spectrum: new SpectrumChart(byId("spectrum")),
      compare: new ComparePanel(byId("compare")),
      motion: new MotionPanel(byId("motion")),
      own: new OwnPanel(byId("own"), viewport),
    };
    // Bars and tables are read, not watched; for a loop, a few pictures per second are enough.
    this.panels.loops.show = beat(LOOPS_MS)(this.panels.loops.show.bind(this.panels.loops));
    for (const panel of [this.panels.energy, this.panels.compare]) panel.show = seldom(panel.show.bind(panel));
    this.tabs = [...document.querySelectorAll("[role=tab]")];
    for (const tab of this.tabs) tab.addEventListener("click", () => this.choose(tab.dataset.panel));
    byId("tabs").addEventListener("keydown", (event) => {
      const by = NEXT[event.key];
      if (!by) return;
      event.preventDefault();
      const tabs = this.tabs.filter((tab) => !tab.hidden);
      const next = tabs[(tabs.indexOf(document.activeElement) + by + tabs.length) % tabs.length];
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

  /** Offer what this run has: own columns where an element shows some. */
  offer({ own }) {
    const tab = this.tabs.find(({ dataset }) => dataset.panel === "own");
    tab.hidden = !own;
    if (!own && this.viewport.panel === "own") this.choose("loops");
  }

  /** Show what a snapshot has for the chosen panel. */
  show(snapshot, state, marks) {
    this.panels[this.viewport.panel].show(snapshot, state, marks);
  }

  /** Fit all axes closely the next time. */
  refit() {
    this.panels.loops.refit();
    this.panels.spectrum.refit();
    this.panels.own.refit();
  }
}
