// The answers that one glance gives.

import { byId, h, renew, say, tone } from "./dom.js";
import { capital, duration, reasonInWords, toneOf } from "./words.js";

function tell(article, headline, detail, kind) {
  say(article.querySelector(".headline"), headline);
  say(article.querySelector(".detail"), detail);
  tone(article, kind);
}

export function showGlance({ trust, imus, link, next_step: next }) {
  renew(byId("glance-imus"), imus.map((imu) => imu.imu), () => imus.map(tile));
  if (link.system_id === null) {
    tell(byId("glance-trust"), "No autopilot yet", "waiting for a heartbeat", "warn");
    return tell(byId("glance-next"), "Connect the autopilot", link.endpoints.map((e) => e.endpoint).join(", "), "");
  }
  showTrust(trust);
  for (const { imu, state } of imus) tell(byId(`glance-imu-${imu}`), capital(state.title), capital(`${state.sentence}.`), toneOf(state.severity));
  if (!next) return tell(byId("glance-next"), "Wait", "for samples of an accelerometer", "");
  tell(byId("glance-next"), capital(next.text), next.imu ? `for IMU ${next.imu}` : "", toneOf(next.severity));
}

function tile({ imu }) {
  return h("article", { id: `glance-imu-${imu}` }, h("h2", { text: `IMU ${imu}` }), h("p", { class: "headline", "aria-live": "polite" }), h("p", { class: "detail" }));
}

function showTrust(trust) {
  const learned = `${duration(trust.trusted_s)} of trusted flight`;
  const reasons = trust.reasons.length ? trust.reasons : trust.reason ? [trust.reason] : [];
  const article = byId("glance-trust");
  if (trust.open) tell(article, "Trusted", `${learned}, in ${trust.windows} window${trust.windows === 1 ? "" : "s"}`, "good");
  else if (trust.phase === "ended") tell(article, "Window ended", learned, "");
  else if (!reasons.length) tell(article, "Not judged yet", learned, "");
  else tell(article, "Not trusted", [...reasons.map(reasonInWords), learned].map((t, i) => (i ? t : capital(t))).join("; "), trust.phase === "suspended" ? "bad" : "warn");
}
