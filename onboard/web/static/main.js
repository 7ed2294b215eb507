// The status page: one snapshot in, all its parts shown.

import { byId, h, renew, say, tone } from "./dom.js";
import { showDiagnosis } from "./diagnosis.js";
import { showGlance } from "./glance.js";
import { Remembered } from "./history.js";
import { Imus } from "./imu.js";
import { showJournal, showLink } from "./link.js";
import { Live } from "./live.js";
import { Push } from "./push.js";
import { clockTime, duration, vehicleInWords } from "./words.js";

const SCHEMA = "onboard.state/1";
const remembered = new Remembered();
const imus = new Imus(remembered);
const push = new Push();
let version = null;
let lastHeard = null;

function showSnapshot(snapshot) {
  if (snapshot.schema !== SCHEMA) return warn(`The service speaks ${snapshot.schema}, this page ${SCHEMA}: reload the page.`);
  version ??= snapshot.version;
  warn(version === snapshot.version ? "" : `The service is now version ${snapshot.version}: reload the page.`);
  lastHeard = Date.now() / 1000;
  remembered.take(snapshot);
  showGlance(snapshot);
  imus.show(snapshot.imus, snapshot.push);
  push.show(snapshot.push, snapshot.imus, snapshot.parameters);
  showDiagnosis(snapshot.diagnosis, snapshot.push);
  showJournal(snapshot.journal, snapshot.notices);
  showLink(snapshot.link, snapshot.counters);
  showHeader(snapshot);
}

function showHeader({ link, mode, mode_reason: why, phase, version: number, uptime_s: uptime }) {
  say(byId("vehicle"), link.system_id === null ? "accelerometer calibration" : vehicleInWords(link));
  const flags = [];
  if (link.armed !== null) flags.push([link.armed ? "armed" : "disarmed", ""]);
  if (link.landed !== null) flags.push([link.landed ? "on the ground" : "in the air", ""]);
  if (mode !== "active") flags.push([mode.replaceAll("_", " "), "warn"]);
  const warnings = link.warnings ?? [];
  if (warnings.length) flags.push([warnings.length === 1 ? "1 warning" : `${warnings.length} warnings`, "warn"]);
  renew(byId("flags"), [flags, why], () => flags.map(([text, kind]) => h("span", { class: `pill ${kind}`, title: mode === "active" ? null : why, text })));
  say(byId("about"), `onboard ${number}, ${phase}, up ${duration(uptime)}`);
}

let banner = "";

function warn(text) {
  banner = text;
  showBanner();
}

let state = "connecting";

function showBanner() {
  const lost = state === "lost";
  const old = lastHeard === null ? "No answer yet." : `What you see is of ${clockTime(lastHeard)}.`;
  const text = lost ? `Connection lost. ${old} Trying again…` : banner;
  byId("banner").hidden = text === "";
  say(byId("banner"), text);
}

/** Charts begin with what the service remembers, also after its restart. */
async function recall() {
  try {
    const response = await fetch("/api/history");
    if (!response.ok) return;
    remembered.load(await response.json());
    imus.redraw();
  } catch {
    // Without it the charts begin here.
  }
}

function showState(next) {
  if (next === state) return;
  state = next;
  if (next === "live") recall();
  document.body.classList.toggle("stale", next === "lost");
  const pill = byId("connection");
  say(pill, next === "lost" ? "connection lost" : next);
  tone(pill, next === "lost" ? "bad" : "good");
  showBanner();
}

const url = new URL("/api/live", location.href);
url.protocol = location.protocol === "https:" ? "wss:" : "ws:";
new Live(url, { onSnapshot: showSnapshot, onState: showState }).connect();
