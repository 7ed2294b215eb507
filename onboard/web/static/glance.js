// The four answers that one glance gives.

import { byId, say, tone } from "./dom.js";
import { capital, duration, passes, reasonInWords, statusInWords, whyNot } from "./words.js";


function tell(id, headline, detail, kind) {
  const article = byId(id);
  say(article.querySelector(".headline"), headline);
  say(article.querySelector(".detail"), detail);
  tone(article, kind);
}

export function showGlance(snapshot) {
  const { trust, imus, link, push } = snapshot;
  if (link.system_id === null) {
    tell("glance-trust", "No autopilot yet", "waiting for a heartbeat", "warn");
    tell("glance-calibration", "Nothing learned yet", "", "warn");
    tell("glance-fly", "Connect the autopilot", link.endpoints.map((e) => e.endpoint).join(", "), "");
  } else {
    showTrust(trust);
    showCalibration(imus);
    showFly(imus, trust);
  }
  showPush(push);
}

function showTrust(trust) {
  const learned = `${duration(trust.trusted_s)} of trusted flight`;
  const reasons = trust.reasons.length ? trust.reasons : trust.reason ? [trust.reason] : [];
  if (trust.open) tell("glance-trust", "Trusted", `${learned}, in ${trust.windows} window${trust.windows === 1 ? "" : "s"}`, "good");
  else if (trust.phase === "ended") tell("glance-trust", "Window ended", learned, "");
  else tell("glance-trust", "Not trusted", [...reasons.map(reasonInWords), learned].map((t, i) => (i ? t : capital(t))).join("; "), trust.phase === "suspended" ? "bad" : "warn");
}

function showCalibration(imus) {
  if (imus.length === 0) return tell("glance-calibration", "Nothing learned yet", "no accelerometer samples", "warn");
  const done = imus.filter((imu) => imu.status === "calibrated").length;
  const kind = imus.some((imu) => imu.status === "invalid") ? "bad" : done === imus.length ? "good" : "warn";
  const headline = done === imus.length ? "Calibrated" : done ? `${done} of ${imus.length} calibrated` : capital(statusInWords(imus[0].status)[0]);
  const detail = imus.map((imu) => `IMU ${imu.imu}: ${imu.calibration.observable.filter(Boolean).length} of 6 numbers, ${Math.round(imu.coverage.percent)} % covered`).join("; ");
  tell("glance-calibration", headline, detail, kind);
}

function showFly(imus, trust) {
  const wanting = imus.filter((imu) => imu.coverage.advice);
  if (imus.length === 0) return tell("glance-fly", "Wait", "for samples of an accelerometer", "");
  if (wanting.length === 0) return tell("glance-fly", "Nothing more needed", trust.open ? "all six numbers are covered" : "", "good");
  const worst = wanting.reduce((a, b) => (a.coverage.percent <= b.coverage.percent ? a : b));
  tell("glance-fly", capital(worst.coverage.advice), `weakest: ${worst.coverage.weakest} of IMU ${worst.imu}`, "warn");
}

function showPush(push) {
  const ready = push.proposals.filter((p) => Object.keys(p.held_back).length === 0);
  const named = (proposals) => proposals.map((p) => `IMU ${p.imu}`).join(", ");
  if (push.state !== "idle") return tell("glance-push", "Writing", push.active_imu ? `IMU ${push.active_imu}` : "an earlier push is finished first", "warn");
  if (push.approval_needed) return tell("glance-push", "Waits for your approval", named(push.proposals), "warn");
  if (ready.length) return tell("glance-push", "About to be written", named(ready), "warn");
  const real = push.proposals.filter((p) => !p.held_back.nothing_to_change);
  const done = push.can_roll_back.length ? `written: ${push.can_roll_back.map((imu) => `IMU ${imu}`).join(", ")}` : "";
  if (real.length === 0) return tell("glance-push", push.can_roll_back.length ? "Up to date" : "Nothing to write", done, push.can_roll_back.length ? "good" : "");
  if (real.every((p) => p.rejected)) return tell("glance-push", "Rejected", named(real), "");
  const open = real.filter((p) => !p.rejected);
  const has = (p, name) => name in p.held_back;
  const sentence = (p) => Object.entries(p.held_back).find(([name]) => !passes(name, p.held_back))?.[1];
  const also = (...parts) => [...parts, done].filter(Boolean).join("; ");
  if (open.every((p) => has(p, "not_calibrated"))) return tell("glance-push", "Nothing to write yet", also(`${named(open)} not calibrated yet`), "");
  const missing = open.find((p) => has(p, "physics_missing"));
  if (missing) return tell("glance-push", "Held back by the diagnosis", also(`IMU ${missing.imu}: ${missing.held_back.physics_missing}`), "bad");
  const soon = open.filter((p) => sentence(p) === undefined);
  if (soon.length) return tell("glance-push", push.policy === "in_flight" ? "Waits for its moment" : "Written after landing", also(named(soon), whyNot(Object.keys(soon[0].held_back)[0], soon[0].held_back)), "");
  tell("glance-push", "Held back", also(sentence(open.find((p) => !has(p, "not_calibrated")))), "");
}
