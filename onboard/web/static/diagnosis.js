// The diagnosis in words: what physics is missing, how sure, and what cures it.

import { byId, h, renew } from "./dom.js";
import { brief, effectInWords, measured, plain, verdictInWords } from "./words.js";

export function showDiagnosis(diagnosis) {
  renew(byId("diagnosis-body"), diagnosis ?? null, () => {
    if (!diagnosis) {
      return [h("p", { class: "soft" }, "None yet. After the flight, ", h("code", { text: "onboard explain" }), " on the recording says what physics is missing beyond the six numbers.")];
    }
    const [sentence, kind] = verdictInWords(diagnosis.verdict);
    const parts = [h("p", { class: kind }, h("strong", { text: sentence }))];
    const effects = diagnosis.effects ?? [];
    if (effects.length) parts.push(h("ul", { class: "held" }, ...effects.map(effect)));
    for (const pair of diagnosis.ambiguous ?? []) {
      parts.push(h("p", { text: `Cannot be told apart on this flight: ${pair.names.map(effectInWords).join(" / ")}. To tell: ${pair.tell_apart}.` }));
    }
    const untestable = diagnosis.not_testable ?? [];
    if (untestable.length) {
      parts.push(h("details", { "data-key": "not-testable" }, h("summary", { text: `Could not be tested: ${untestable.length}` }), h("ul", { class: "held" }, ...untestable.map((item) => h("li", { text: `${effectInWords(item.name)}: ${item.why}` })))));
    }
    return parts;
  });
}

function effect(found) {
  const unknowns = Object.entries(found.unknowns ?? {}).map(([name, u]) => `${plain(name)} ${measured(u.value, u.sigma)} ± ${brief(u.sigma, 2)} ${u.unit}`);
  const cure = Object.entries(found.parameters ?? {}).map(([name, value]) => `${name} = ${brief(value, 4)}`);
  const share = typeof found.share_of_mismatch === "number" ? `, ${Math.round(100 * found.share_of_mismatch)} % of the mismatch` : "";
  const item = h("li", {}, h("strong", { text: effectInWords(found.name) }), ` (${unknowns.join("; ") || found.formula || plain(found.name)})${share}.`);
  if (cure.length) item.append(" Cure: ", h("span", { class: "name", text: cure.join(", ") }), ".");
  else if (found.cure) item.append(` Cure: ${found.cure}.`);
  return item;
}
