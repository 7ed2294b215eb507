// One small chart per number: the estimate with its band against the value in force.

const SIGMAS = 2;

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Range that shows band and value in force; the wide bands of the beginning do not squeeze it. */
function span(plot) {
  const [, value, low, high, inForce] = plot.data;
  const known = [];
  const from = Math.floor(value.length * 0.15); // what it began with may leave the picture
  for (let i = from; i < value.length; i += 1) known.push(low[i], high[i], inForce[i]);
  const finite = known.filter((x) => x !== null && x !== undefined);
  if (finite.length === 0) return [-1, 1];
  const least = Math.min(...finite);
  const most = Math.max(...finite);
  const margin = (most - least || Math.abs(most) * 0.01 || 0.01) * 0.08;
  return [least - margin, most + margin];
}

/** Steps between two marks of the time axis, s: those that people count in. */
const STEPS = [1, 2, 5, 10, 20, 30, 60, 120, 180, 300, 600, 1200, 1800, 3600, 7200, 18000, 36000];

/** Marks of a time axis (s) in the unit that makes them whole numbers; the last one names it. */
export function elapsed(marks) {
  const whole = (unit) => marks.every((mark) => mark % unit === 0) && marks.at(-1) >= unit;
  const [unit, name] = whole(3600) ? [3600, "h"] : whole(60) ? [60, "min"] : [1, "s"];
  return marks.map((mark, at) => `${mark / unit}${at === marks.length - 1 ? ` ${name}` : ""}`);
}

export class Chart {
  /** Draws into `host`; number `index` of the six. */
  constructor(host, index) {
    this.host = host;
    this.index = index;
    this.plot = null;
  }

  show(history) {
    const width = this.host.clientWidth;
    const height = this.host.clientHeight;
    if (width === 0) return;
    const value = history.column(1 + this.index);
    const sigma = history.column(7 + this.index);
    const edge = (sign) => value.map((v, i) => (v === null || sigma[i] === null ? null : v + sign * SIGMAS * sigma[i]));
    const data = [history.column(0), value, edge(-1), edge(1), history.column(13 + this.index)];
    if (this.plot === null) this.plot = new window.uPlot(this.options(width, height), data, this.host);
    else {
      if (this.plot.width !== width || this.plot.height !== height) this.plot.setSize({ width, height });
      this.plot.setData(data);
    }
  }

  /** Drop the drawing, for a new theme or another accelerometer. */
  forget() {
    this.plot?.destroy();
    this.plot = null;
  }

  options(width, height) {
    const ink = colour("--ink-soft");
    const line = colour("--line");
    const axis = { stroke: ink, font: `11px ${colour("--sans")}`, ticks: { show: false }, gap: 3 };
    const edge = { stroke: "transparent", points: { show: false } };
    return {
      width,
      height,
      padding: [6, 12, 0, 0],
      legend: { show: false },
      cursor: { show: false },
      scales: { x: { time: false, range: (_, _least, most) => [0, Math.max(most, 1)] }, y: { range: span } },
      axes: [
        { ...axis, size: 18, space: 34, incrs: STEPS, values: (_, marks) => elapsed(marks), grid: { stroke: line, width: 1 } },
        { ...axis, size: 44, space: 28, grid: { stroke: line, width: 1 } },
      ],
      series: [
        {},
        { stroke: colour("--estimate"), width: 1.8, points: { show: false } },
        edge,
        edge,
        { stroke: colour("--in-force"), width: 1.5, dash: [5, 4], points: { show: false }, paths: window.uPlot.paths.stepped({ align: 1 }) },
      ],
      bands: [{ series: [3, 2], fill: colour("--band") }],
    };
  }
}
