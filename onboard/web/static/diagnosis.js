// The diagnosis in words: what physics is missing, how sure, what cures it, what it holds back.

import { byId, h, renew } from "./dom.js";
import { brief, capital, effectInWords, measured, plain, toneOf, unitInWords } from "./words.js";

const LEVELS = { info: "worth knowing, in every calibration", warning: "matters", error: "dangerous" };

export function showDiagnosis(diagnosis, push) {
  const held = (push?.proposals ?? []).filter((p) => p.held_back.physics_missing).map((p) => `IMU ${p.imu}`);
  renew(byId("diagnosis-body"), [diagnosis ?? null, held], () => {
    if (!diagnosis) {
      return [h("p", { class: "soft" }, "None yet. After the flight, ", h("code", { text: "onboard explain" }), " on the recording says what physics is missing beyond the six numbers.")];
    }
    const imu = diagnosis.recording?.imu;
    const sentence = diagnosis.headline ?? capital(plain(diagnosis.verdict));
    const parts = [h("p", { class: toneOf(diagnosis.severity ?? "info") }, h("strong", { text: sentence }))];
    const effects = diagnosis.effects ?? [];
    if (effects.length) parts.push(...effects.map(effect));
    if (diagnosis.verdict !== "insufficient") parts.push(...proof(diagnosis.mismatch, effects.length > 0));
    else if (diagnosis.note) parts.push(h("ul", { class: "held" }, ...diagnosis.note.split(/(?<=\.)\s+/).map((text) => h("li", { text: text[1] === " " ? text : capital(text) }))));
    if (held.length) parts.push(h("p", {}, "Because of this the new values are ", h("a", { href: "#push", text: "held back" }), ` for ${held.join(", ")}.`));
    for (const pair of diagnosis.ambiguous ?? []) {
      parts.push(h("p", { text: `Cannot be told apart on this flight: ${pair.names.map(effectInWords).join(" / ")}. To tell: ${pair.tell_apart}.` }));
    }
    const untestable = diagnosis.not_testable ?? [];
    if (untestable.length) {
      parts.push(h("details", { "data-key": "not-testable" }, h("summary", { text: `Could not be tested: ${untestable.length}` }), h("ul", { class: "held" }, ...untestable.map((item) => h("li", { text: `${effectInWords(item.name)}: ${item.why}` })))));
    }
    if (imu) parts.push(h("p", { class: "soft", text: `Of accelerometer ${imu}, from its last flight.` }));
    return parts;
  });
}

/** Velocity error on flight that was not fitted, as far as it is known. */
function proof(mismatch, found) {
  const before = mismatch?.held_out_velocity_rms_before_m_s;
  const after = mismatch?.held_out_velocity_rms_after_m_s;
  if (typeof after !== "number") return [];
  const was = found && typeof before === "number" ? `; it was ${brief(before, 2)} m/s with scale and offset only` : "";
  return [h("p", { class: "soft", text: `On parts of the flight that the fit did not use, the predicted velocity differs from GPS by ${brief(after, 2)} m/s${was}.` })];
}

function effect(found) {
  const share = [
    LEVELS[found.severity] ?? "",
    typeof found.share_of_mismatch === "number" ? `${Math.round(100 * found.share_of_mismatch)} % of the mismatch` : "",
  ].filter(Boolean).join("; ");
  const facts = Object.entries(found.unknowns ?? {}).map(([name, u]) => [plain(name), `${measured(u.value, u.sigma)} ± ${brief(u.sigma, 2)}\u00a0${unitInWords(u.unit)}`]);
  if (found.formula) facts.push(["formula", found.formula]);
  if (found.danger) facts.push(["danger", `${found.danger}. Do not fly before it is cured.`]);
  if (found.cure) facts.push(["to do", found.cure]);
  // As it is typed into a ground station: a plain minus sign.
  const settings = Object.entries(found.parameters ?? {}).map(([name, value]) => h("span", { class: "name", text: `${name} = ${brief(value, 4).replace("−", "-")}` }));
  return h(
    "div",
    { class: "effect" },
    h("h3", {}, effectInWords(found.name), ...(share ? [h("span", { class: "soft", text: ` ${share}` })] : [])),
    h(
      "dl",
      { class: "facts" },
      ...facts.flatMap(([name, text]) => [h("dt", { text: name }), h("dd", { text })]),
      ...(settings.length ? [h("dt", { text: "set" }), h("dd", {}, ...settings.flatMap((s, i) => (i ? [h("br"), s] : [s])))] : []),
    ),
  );
}
