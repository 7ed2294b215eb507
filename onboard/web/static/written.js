// What was written, for good: an estimate is compared with what is in force, which it then is itself.

import { byId, h, renew } from "./dom.js";
import { brief, fixed, moment } from "./words.js";

const BETTER = { kept: "good", doubted: "warn", worse: "bad", superseded: "" };

/** The pushes of one accelerometer, newest first. */
export function showWritten(push, imu) {
  const written = (push.written ?? []).filter((one) => one.imu === imu).reverse();
  byId("written").hidden = written.length === 0;
  renew(byId("written-body"), [imu, written], () => {
    const [latest, ...earlier] = written;
    if (!latest) return [];
    const parts = [oneOf(latest)];
    if (earlier.length) parts.push(h("details", { "data-key": `written-${imu}` }, h("summary", { text: `Written before: ${earlier.length}` }), ...earlier.map(oneOf)));
    return parts;
  });
}

function oneOf(push) {
  const when = `IMU ${push.imu}, ${moment(push.at)}${push.in_force ? "" : " (no longer in force)"}`;
  const rows = [
    ["Velocity residual, m/s", push.velocity_rms_before_m_s, push.velocity_rms_after_m_s, push.next_velocity_rms_m_s],
    ["Residual on parts not fitted (1 is noise)", push.held_out_before, push.held_out_after, push.next_held_out],
  ];
  return h(
    "div",
    { class: "effect" },
    h("h3", { text: when }),
    ...told(push),
    h("details", { "data-key": `residuals-${push.imu}-${push.at}`, open: !push.account }, h("summary", { text: "Residuals" }), h("div", { class: "scroll" }, h(
      "table",
      { class: "compare" },
      h("thead", {}, h("tr", {}, ...["", "old values", "new values", "next flight"].map((text) => h("th", { scope: "col", text })))),
      h("tbody", {}, ...rows.map(([name, ...values]) => h("tr", {}, h("th", { scope: "row", text: name }), ...values.map((value) => h("td", { class: "number", text: brief(value) }))))),
    ))),
    ...(push.account ? [] : [push.verdict ? h("p", { class: BETTER[push.verdict] ?? "", text: `The flight after it: ${push.verdict_sentence}.` }) : h("p", { class: "soft", text: "The next flight will say whether it was right." })]),
    h("details", { "data-key": `values-${push.imu}-${push.at}` }, h("summary", { text: "The values" }), valuesTable(push.values)),
  );
}

/** What was wrong, what was written, what it improved, what to do next. */
function told({ account, verdict }) {
  if (!account) return [];
  const rows = [["What was wrong", account.wrong], ["What was written", account.written], ["What it improved", account.improved], ["What to do next", account.next]];
  return [h("dl", { class: "account" }, ...rows.flatMap(([name, text]) => [h("dt", { text: name }), h("dd", { class: text === account.next ? BETTER[verdict] : null, text })]))];
}

/** Old and new of each value; with what is in force `now`, by name: of the way back. */
export function valuesTable(values, { now = null } = {}) {
  const decimals = ({ name }) => (name.includes("SCAL") ? 5 : 4);
  const pair = ({ name, before, written }) => (now ? [now[name] ?? written, before] : [before, written]);
  const headings = now ? ["in force", "to be written"] : ["before", "written"];
  return h("div", { class: "scroll" }, h(
    "table",
    { class: "changes" },
    h("thead", {}, h("tr", {}, h("th", { scope: "col", text: "Parameter" }), ...headings.map((text) => h("th", { scope: "col", class: "number", text })))),
    h("tbody", {}, ...values.map((value) => h(
      "tr",
      {},
      h("td", { class: "name", text: value.name }),
      h("td", { class: "number", text: fixed(pair(value)[0], decimals(value)) }),
      h("td", { class: "number to", text: fixed(pair(value)[1], decimals(value)) }),
    ))),
  ));
}
