// Link health, message rates and the journal.

import { byId, h, renew } from "./dom.js";
import { clockTime, fixed, plain, vehicleInWords } from "./words.js";

const ABSENT = ["unsupported", "silent"];
const SLOW = 0.7; // of the rate that was granted

export function showLink(link, counters = {}) {
  const { frames = 0, heard = frames, lost = 0, bad_frames: damaged = 0, reboots = 0 } = link.counters;
  const share = heard + lost > 0 ? (100 * lost) / (heard + lost) : 0;
  const facts = [
    ["Autopilot", link.system_id === null ? "none heard yet" : `${vehicleInWords(link)}, ${link.state}`],
    ...link.endpoints.map((e) => [e.endpoint, e.reason ? `${e.state}: ${e.reason}` : e.state]),
    ["Frames", `${frames.toLocaleString("en")}, lost ${fixed(share, 1)} %, damaged ${damaged}`],
    ["Signed", link.signed ? "yes" : "no"],
    ...(link.warnings ?? []).map((text) => ["Warning", text]),
    ...(reboots ? [["Reboots", String(reboots)]] : []),
    ...(counters.loop_stalls ? [["Stalls", `${counters.loop_stalls}, ${counters.loop_stall_worst_ms} ms at most`]] : []),
  ];
  const rates = Object.entries(link.messages)
    .map(([name, rate]) => [name, rate.rate_hz, rate.granted_hz ?? rate.wanted_hz, rate.stream])
    .filter(([, rate, wanted]) => rate > 0 || wanted !== null)
    .sort((a, b) => Number(b[2] !== null) - Number(a[2] !== null) || (a[0] < b[0] ? -1 : 1));
  renew(byId("link-body"), [facts, rates], () => [
    h("dl", { class: "facts" }, ...facts.flatMap(([name, text]) => [h("dt", { text: name }), h("dd", { class: name === "Warning" ? "warn" : null, text })])),
    ...(rates.length ? [ratesTable(rates)] : []),
  ]);
}

function ratesTable(rates) {
  return h(
    "div",
    { class: "scroll" },
    h(
      "table",
      { class: "rates" },
      h("thead", {}, h("tr", {}, h("th", { scope: "col", text: "Message" }), h("th", { scope: "col", class: "number", text: "Hz" }), h("th", { scope: "col", class: "number", text: "asked for" }))),
      h("tbody", {}, ...rates.map(([name, rate, wanted, stream]) => {
        const absent = ABSENT.includes(stream) && rate === 0; // the autopilot has no such thing
        const slow = wanted !== null && !absent && rate < SLOW * wanted;
        return h(
          "tr",
          {},
          h("td", { class: "name", text: name }),
          h("td", { class: `number ${slow ? "warn" : ""}`, text: absent ? "none" : fixed(rate, 1) + (slow ? " (slow)" : "") }),
          h("td", { class: "number soft", text: wanted === null ? "" : fixed(wanted, 1) + (stream === "granted" || stream === "flowing" || stream === null ? "" : ` (${plain(stream)})`) }),
        );
      })),
    ),
  );
}

// What has a line of the journal needs no second one, unless it is a warning.
const isNews = ({ kind, warning }) => warning || !/^(push|roll_back)_|^diagnosed$/.test(kind);

/**
 * What the journal has of this run and the notices, which are all of this run, then the journal of
 * before; newest first.  Companions without a clock of their own set it at any moment, and begin
 * with one that is behind: what a list has in its order stays in it, whatever the times say.
 */
export function inOrder(journal, notices) {
  const now = journal.filter((line) => !line.earlier);
  const lines = [];
  for (let [i, j] = [now.length, notices.length]; i + j > 0; )
    lines.push(j === 0 || (i > 0 && now[i - 1].at > notices[j - 1].at) ? now[--i] : notices[--j]);
  return [...lines, ...journal.filter((line) => line.earlier).reverse()];
}

/** Journal and notices in one list, newest first. */
export function showJournal(journal, notices) {
  const lines = inOrder(
    journal.map((line) => ({ at: line.at, text: line.imu ? `IMU ${line.imu}: ${line.text}` : line.text, kind: "", earlier: line.earlier })),
    notices.filter(isNews).map((notice) => ({ at: notice.at, text: notice.text, kind: notice.warning ? "warn" : "" })),
  );
  renew(byId("journal-lines"), lines, () =>
    lines.length
      ? lines.map((line) => h("li", {}, h("time", { datetime: new Date(line.at * 1000).toISOString(), text: clockTime(line.at) }), h("span", { class: line.kind, text: line.text })))
      : [h("li", {}, h("span", { class: "soft", text: "nothing yet" }))],
  );
}
