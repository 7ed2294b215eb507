/* Charts that can be read off and looked into: a cursor with the values of every curve, and a part of the
   horizontal axis by dragging.  Without this script the page shows the same charts, still. */
"use strict";
(() => {
  const WIDTH = 1000, HEIGHT = 300, LEAST_SHARE = 0.01, LEAST_DRAG_PX = 6, STEPS_PER_SPAN = 5, GAP_STEPS = 4;
  const short = (value) => String(Number(value.toPrecision(4))).replace("-", "\u2212");
  const made = (parent, kind) => {
    const element = document.createElement("span");
    element.className = kind;
    element.hidden = true;
    parent.append(element);
    return element;
  };

  /* Round numbers within a range, as the axis of the page has them. */
  const marks = (low, high) => {
    const raw = (high - low) / STEPS_PER_SPAN, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= raw * (1 - 1e-9));
    const out = [];
    for (let k = Math.ceil(low / step); k * step <= high; k += 1) out.push(k * step);
    return out;
  };

  /* Corners of a curve as they were drawn. */
  const corners = (path) => path.getAttribute("d").split(/[ML]/).slice(1).map((c) => c.split(" ").map(Number));
  const nearest = (points, px) => {
    let low = 0, high = points.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (points[middle][0] < px) low = middle; else high = middle;
    }
    const found = px - points[low][0] < points[high][0] - px ? points[low] : points[high];
    /* Further away than a few usual steps there is a gap, and nothing to read. */
    const step = (points.at(-1)[0] - points[0][0]) / (points.length - 1);
    return Math.abs(found[0] - px) <= GAP_STEPS * step ? found : null;
  };

  class Chart {
    constructor(plot) {
      this.plot = plot;
      this.svg = plot.querySelector("svg");
      [this.x0, this.x1] = plot.dataset.x.split(" ").map(Number);
      [this.y0, this.y1] = plot.dataset.y.split(" ").map(Number);
      this.unitSize = Number(plot.dataset.size);
      this.shown = [this.x0, this.x1];
      this.at = 0.5;
      this.cursor = made(plot, "cursor");
      this.chosen = made(plot, "chosen");
      this.readout = made(plot, "readout");
      this.readout.setAttribute("role", "status");
      plot.tabIndex = 0;
      plot.setAttribute("role", "group");
      plot.setAttribute("aria-label", `${this.svg.getAttribute("aria-label")}. Arrow keys read values.`);
    }

    share(event) {
      const box = this.svg.getBoundingClientRect();
      return Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
    }

    value(share) { return this.shown[0] + share * (this.shown[1] - this.shown[0]); }

    lines() {
      this.drawn ??= [...this.svg.querySelectorAll("path.line")].map((path) => [path.dataset.label, corners(path)]);
      return this.drawn.filter(([, points]) => points.length > 1);
    }

    read(share) {
      this.at = share;
      const x = this.value(share), px = WIDTH * (x - this.x0) / (this.x1 - this.x0);
      const told = this.lines().map(([label, points]) => {
        const found = nearest(points, px);
        return `${label} ${found ? short(this.y1 - found[1] / HEIGHT * (this.y1 - this.y0)) : "\u2013"}`;
      });
      this.readout.textContent = [`${short(x / this.unitSize)} ${this.plot.dataset.unit}`, ...told].join(" \u00b7 ");
      this.cursor.style.left = `${100 * share}%`;
      this.readout.style[share < 0.5 ? "left" : "right"] = "4px";
      this.readout.style[share < 0.5 ? "right" : "left"] = "auto";
      this.cursor.hidden = this.readout.hidden = false;
    }

    leave() { this.cursor.hidden = this.readout.hidden = this.chosen.hidden = true; }

    show(low, high) {
      this.shown = [low, high];
      const scale = WIDTH / (this.x1 - this.x0);
      this.svg.setAttribute("viewBox", `${(low - this.x0) * scale} 0 ${(high - low) * scale} ${HEIGHT}`);
      const whole = low === this.x0 && high === this.x1;
      for (const tick of this.plot.querySelectorAll(".tick.x")) {
        if (tick.dataset.zoomed) tick.remove(); else tick.hidden = !whole;
      }
      for (const grid of this.svg.querySelectorAll(".upright")) grid.style.display = whole ? "" : "none";
      if (whole) return;
      for (const at of marks(low / this.unitSize, high / this.unitSize)) {
        const tick = made(this.plot, "tick x");
        tick.dataset.zoomed = "1";
        tick.hidden = false;
        tick.textContent = short(at);
        tick.style.left = `${100 * (at * this.unitSize - low) / (high - low)}%`;
      }
    }
  }

  const charts = [...document.querySelectorAll(".plot[data-x]")].map((plot) => new Chart(plot));
  /* Charts of one flight share its time: they are looked into together. */
  const zoom = (chart, low, high) => {
    for (const other of charts) {
      if (other.plot.dataset.x === chart.plot.dataset.x && other.plot.dataset.unit === chart.plot.dataset.unit) other.show(low, high);
    }
  };
  for (const chart of charts) {
    const { plot } = chart;
    let begun = null;
    plot.addEventListener("pointermove", (event) => {
      const share = chart.share(event);
      chart.read(share);
      if (begun === null) return;
      chart.chosen.hidden = false;
      chart.chosen.style.left = `${100 * Math.min(begun, share)}%`;
      chart.chosen.style.width = `${100 * Math.abs(share - begun)}%`;
    });
    plot.addEventListener("pointerdown", (event) => {
      if (event.pointerType !== "touch" && event.button === 0) begun = chart.share(event);
      chart.read(chart.share(event));
    });
    plot.addEventListener("pointerup", (event) => {
      const ended = chart.share(event), from = begun;
      begun = null;
      chart.chosen.hidden = true;
      if (from === null || Math.abs(ended - from) * plot.clientWidth < LEAST_DRAG_PX) return;
      const [low, high] = [from, ended].sort((a, b) => a - b).map((share) => chart.value(share));
      if (high - low >= LEAST_SHARE * (chart.x1 - chart.x0)) zoom(chart, low, high);
    });
    plot.addEventListener("pointerleave", () => { begun = null; chart.leave(); });
    plot.addEventListener("dblclick", () => zoom(chart, chart.x0, chart.x1));
    plot.addEventListener("blur", () => chart.leave());
    plot.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.01, ArrowRight: 0.01 }[event.key];
      if (step !== undefined) {
        chart.read(Math.min(Math.max(chart.at + step, 0), 1));
        event.preventDefault();
      } else if (event.key === "Escape") {
        zoom(chart, chart.x0, chart.x1);
        chart.leave();
      }
    });
  }
  if (charts.length) document.querySelector("#reading").hidden = false;
  /* A table that is wider than the screen is scrolled by keyboard, too; others are no stop on the way. */
  const reach = () => {
    for (const part of document.querySelectorAll(".scroll")) {
      if (part.scrollWidth > part.clientWidth) part.tabIndex = 0;
      else part.removeAttribute("tabindex");
    }
  };
  addEventListener("resize", reach);
  reach();
})();
