// The accelerometers: tabs, six numbers with charts and coverage, residual before and after.

import { Chart } from "./charts.js";
import { byId, h, renew, say } from "./dom.js";
import { brief, duration, fixed, measured, parameterName } from "./words.js";
import { showWritten } from "./written.js";

const NAMES = ["x scale", "y scale", "z scale", "x offset", "y offset", "z offset"];
const ENOUGH_PERCENT = 60;

/** One of the six: heading, value, in force, chart, coverage. */
class Axis {
  constructor(index) {
    this.index = index;
    this.parameter = h("span", { class: "name" });
    this.number = h("span");
    this.sigma = h("small");
    this.force = h("p", { class: "force" });
    this.percent = h("span", { class: "number" });
    this.fill = h("div", { class: "fill" });
    const host = h("div", { class: "chart", "aria-hidden": "true" });
    this.chart = new Chart(host, index);
    this.element = h(
      "article",
      { class: "axis", "data-axis": NAMES[index] },
      h("h3", {}, h("span", { text: NAMES[index] }), this.parameter),
      h("p", { class: "value" }, this.number, " ", this.sigma),
      this.force,
      host,
      h("div", { class: "cover" }, h("span", { text: "coverage" }), h("div", { class: "track", "aria-hidden": "true" }, this.fill), this.percent),
    );
  }

  show(view) {
    const of = (scale, offset) => (this.index < 3 ? scale : offset)[this.index % 3];
    const c = view.calibration;
    const value = of(c.scale, c.offset);
    const sigma = of(c.scale_sigma, c.offset_sigma);
    const inForce = of(view.in_force_scale, view.in_force_offset);
    const unit = this.index < 3 ? "" : " m/s²";
    const covered = view.coverage.per_parameter[NAMES[this.index]] ?? 0;
    say(this.parameter, parameterName(view.imu, this.index));
    say(this.number, measured(value, sigma));
    const seen = { yes: "", roughly: "", together: ", known together with its other number" }[c.known[this.index]] ?? ", not observed yet";
    say(this.sigma, value === null ? "no estimate yet" : `± ${brief(sigma, 2)}${unit}`);
    say(this.force, `in force ${view.parameters_known ? "" : "(assumed) "}${measured(inForce, sigma)}${seen}`);
    say(this.percent, `${Math.round(covered)} %`);
    const width = `${Math.max(0, Math.min(100, covered))}%`;
    if (this.fill.style.width !== width) this.fill.style.width = width;
    this.fill.classList.toggle("low", covered < ENOUGH_PERCENT);
  }
}

export class Imus {
  constructor(remembered) {
    this.remembered = remembered;
    this.chosen = null;
    this.views = [];
    this.axes = NAMES.map((_, index) => new Axis(index));
    byId("axes").append(...this.axes.map((axis) => axis.element));
    const redraw = () => this.redraw();
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.forget();
      this.redraw();
    });
    new ResizeObserver(redraw).observe(byId("axes"));
    document.addEventListener("visibilitychange", redraw);
    byId("imu-tabs").addEventListener("keydown", (event) => this.step(event));
  }

  show(views, push) {
    this.views = views;
    this.push = push;
    if (!views.some((view) => view.imu === this.chosen)) this.choose(views[0]?.imu ?? null);
    renew(byId("imu-tabs"), [this.chosen, views.map((v) => v.imu)], () => views.map((v) => this.tab(v)));
    const view = this.view;
    byId("imu").hidden = view === undefined;
    byId("residual").hidden = view === undefined;
    if (view === undefined) return showWritten(push, null);
    for (const axis of this.axes) axis.show(view);
    this.showResidual(view);
    showWritten(this.push, view.imu);
    this.redraw();
  }

  get view() {
    return this.views.find((view) => view.imu === this.chosen);
  }

  tab(view) {
    const chosen = view.imu === this.chosen;
    return h("button", {
      type: "button",
      role: "tab",
      id: `tab-${view.imu}`,
      "data-key": `tab-${view.imu}`,
      "aria-selected": String(chosen),
      "aria-controls": "axes",
      tabindex: chosen ? "0" : "-1",
      text: `IMU ${view.imu}`,
      onclick: () => {
        this.choose(view.imu);
        this.show(this.views, this.push);
      },
    });
  }

  choose(imu) {
    if (imu === this.chosen) return;
    this.chosen = imu;
    byId("axes").setAttribute("aria-labelledby", `tab-${imu}`);
    this.forget();
  }

  step(event) {
    const by = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (by === undefined || this.views.length < 2) return;
    const at = this.views.findIndex((view) => view.imu === this.chosen);
    this.choose(this.views[(at + by + this.views.length) % this.views.length].imu);
    this.show(this.views, this.push);
    byId(`tab-${this.chosen}`)?.focus();
    event.preventDefault();
  }

  forget() {
    for (const axis of this.axes) axis.chart.forget();
  }

  redraw() {
    if (document.hidden || this.chosen === null) return;
    const history = this.remembered.of(this.chosen);
    say(byId("axes-span"), history.seconds > 0 ? `over ${duration(history.seconds)} of trusted flight` : "nothing flown yet");
    for (const axis of this.axes) axis.chart.show(history);
  }

  showResidual(view) {
    const drift = view.dead_reckoning;
    const rows = [
      ["Velocity residual", view.velocity_rms_before_m_s, view.velocity_rms_after_m_s, "m/s"],
      ["Residual in units of the noise (1 is ideal)", view.whitened_rms_before, view.whitened_rms_after, ""],
      ["The same on parts that the fit did not see", view.held_out_before, view.held_out_after, ""],
    ];
    if (drift) rows.push([`Drift without GPS over ${fixed(drift.horizon_s, 0)} s`, drift.drift_before_m_s, drift.drift_after_m_s, "m/s"]);
    const bound = view.certificate;
    const shown = rows.map(([name, before, after, unit]) => [name, brief(before), brief(after), unit]);
    const told = bound && [bound.uniform_bound_m_s, bound.window_s, bound.observed_max_m_s].map((x) => brief(x));
    renew(byId("residual-body"), [view.imu, shown, told], () => {
      const parts = [
        h("div", { class: "scroll" }, h(
          "table",
          { class: "compare" },
          h("thead", {}, h("tr", {}, h("th", { scope: "col", text: `IMU ${view.imu}` }), h("th", { scope: "col", text: "in force" }), h("th", { scope: "col", text: "estimate" }), h("td", { class: "bars" }))),
          h("tbody", {}, ...rows.map((row, at) => residualRow(row, shown[at]))),
        )),
        h("p", { class: "soft", text: "Both columns are about the flight so far. In force: with the values that the autopilot uses now. Estimate: with the values that are known now." }),
      ];
      if (told) parts.push(h("p", { text: `Certificate: over ${told[1]} s the velocity residual is nowhere above ${told[0]} m/s (seen: ${told[2]} m/s).` }));
      return parts;
    });
  }
}

function residualRow([name, before, after], [, beforeText, afterText, unit]) {
  const most = Math.max(before ?? 0, after ?? 0) || 1;
  const bar = (kind, value) => {
    const element = h("div", { class: `bar ${kind}` });
    element.style.width = `${(100 * (value ?? 0)) / most}%`;
    return element;
  };
  const suffix = unit ? ` ${unit}` : "";
  return h(
    "tr",
    {},
    h("th", { scope: "row", text: name }),
    h("td", { class: "number", text: beforeText + suffix }),
    h("td", { class: "number", text: afterText + suffix }),
    h("td", { class: "bars", "aria-hidden": "true" }, bar("before", before), bar("after", after)),
  );
}
