// What will be written, and the three things that a person may say to it.

import { byId, h, renew, say } from "./dom.js";
import { valuesTable } from "./written.js";
import { brief, capital, fixed, plain, policyInWords } from "./words.js";

const TOKEN_KEY = "onboard token";
const WAIT_MS = 15000;
const DIAGNOSIS = ["physics_missing", "imu_stuck", "not_diagnosed"]; // reasons that a person lifts by saying so explicitly

const QUESTIONS = {
  approve: (imus) => [`Write the new values for ${imus}?`, "They are written as soon as policy and flight state allow, read back, and watched in the next flight."],
  override: (imus, why) => [`Write the new values for ${imus} although the diagnosis is against it?`, `${capital(why)}.`],
  reject: (imus) => [`Reject the new values for ${imus}?`, "Nothing is written until it is approved or what was learned is forgotten."],
  rollback: (imus) => [`Roll back ${imus}?`, "The values from before the last push are written again:"],
  reset: () => ["Forget what was learned?", "Of all accelerometers: learning begins anew. The autopilot's parameters stay as they are."],
};
const SIGMAS = () => h("p", { class: "soft", text: "± here: accelerometer and gyroscope together, which is what navigates. On the cards: the accelerometer alone." });
const LABELS = { approve: "Approve", override: "Approve all the same", reject: "Reject", rollback: "Roll back", reset: "Forget what was learned" };

export class Push {
  constructor() {
    this.token = byId("token-field");
    this.token.value = sessionStorage.getItem(TOKEN_KEY) ?? "";
    this.token.addEventListener("change", () => sessionStorage.setItem(TOKEN_KEY, this.token.value));
    byId("token-form").addEventListener("submit", (event) => event.preventDefault());
    this.asked = null;
    const dialog = byId("confirm");
    byId("confirm-no").addEventListener("click", () => dialog.close());
    byId("confirm-yes").addEventListener("click", () => {
      const asked = this.asked;
      dialog.close();
      if (asked) this.send(asked.action, asked.imus);
    });
    dialog.addEventListener("close", () => {
      this.asked = null;
    });
  }

  show(push, imus, parameters) {
    this.push = push;
    this.parameters = parameters;
    const approval = push.approval_required ? ", after a person has approved" : "";
    const doing = push.state === "idle" ? "" : ` Now: ${plain(push.state)}${push.active_imu ? `, IMU ${push.active_imu}` : ""}.`;
    const last = push.last_outcome ? ` Last time: ${push.last_outcome}` : "";
    say(byId("push-state"), `Policy: ${policyInWords(push.policy)}${approval}.${doing}${last}`);
    const unfinished = push.unfinished ?? [];
    renew(byId("unfinished"), unfinished, () => unfinished.map(notEnded));
    const states = new Map(imus.map(({ imu, state }) => [imu, state]));
    renew(byId("proposals"), [push.proposals, [...states]], () =>
      push.proposals.length
        ? [...push.proposals.map((proposal) => this.proposal(proposal, states.get(proposal.imu))), SIGMAS()]
        : [h("p", { class: "soft", text: "Nothing is proposed yet: no accelerometer has an answer that differs from the values in force." })],
    );
    renew(byId("push-all"), [push.can_roll_back, imus.length > 0], () => [
      ...push.can_roll_back.map((imu) => this.button("rollback", [imu], { text: `Roll back IMU ${imu}` })),
      ...(imus.length ? [this.button("reset", [])] : []),
    ]);
  }

  proposal(proposal, state) {
    const imus = [proposal.imu];
    const title = `IMU ${proposal.imu}: ${state?.title ?? "proposed"}`;
    if (state?.name === "up_to_date") return same(proposal, title, state);
    const reasons = Object.values(proposal.held_back);
    return h(
      "div",
      { class: "proposal", "data-imu": proposal.imu },
      h("h3", { text: title }),
      changesTable(proposal.changes),
      ...(proposal.changes.some((c) => c.kept) ? [h("p", { class: "soft", text: "Kept: not shown by the flight, stays as it is." })] : []),
      ...(reasons.length ? [h("p", { class: "soft", text: "Not written now because:" }), h("ul", { class: "held" }, ...reasons.map((text) => h("li", { text })))] : []),
      h(
        "div",
        { class: "row actions" },
        against(proposal) && proposal.approvable ? this.button("override", imus) : this.button("approve", imus, { class: proposal.approvable ? "primary" : "", disabled: !proposal.approvable }),
        this.button("reject", imus, { disabled: proposal.rejected }),
      ),
    );
  }

  button(action, imus, attributes = {}) {
    return h("button", {
      type: "button",
      text: LABELS[action],
      "data-key": `${action}-${imus.join("-")}`,
      "data-action": action,
      "aria-label": imus.length ? `${LABELS[action]} IMU ${imus.join(", ")}` : LABELS[action],
      ...attributes,
      onclick: () => this.ask(action, imus),
    });
  }

  ask(action, imus) {
    const named = imus.map((imu) => `IMU ${imu}`).join(", ");
    const proposal = this.push.proposals.find((p) => imus.includes(p.imu));
    const [title, text] = QUESTIONS[action](named, against(proposal));
    this.asked = { action, imus };
    say(byId("confirm-title"), title);
    say(byId("confirm-text"), text);
    say(byId("confirm-yes"), LABELS[action]);
    byId("confirm-changes").replaceChildren(...this.table(action, imus, proposal));
    byId("confirm").showModal();
    byId("confirm-no").focus(); // Enter by mistake changes nothing
  }

  /** What would be written, old and new, before it is asked for. */
  table(action, imus, proposal) {
    if (["approve", "override"].includes(action) && proposal) return [changesTable(proposal.changes)];
    const half = action === "rollback" && (this.push.unfinished ?? []).find((one) => imus.includes(one.imu));
    if (half) return [valuesTable(half.values, { now: this.parameters })];
    const written = action === "rollback" && (this.push.written ?? []).find((push) => push.in_force && imus.includes(push.imu));
    return written ? [valuesTable(written.values, { now: this.parameters })] : [];
  }

  async send(action, imus) {
    const headers = { "Content-Type": "application/json" };
    if (this.token.value) headers.Authorization = `Bearer ${this.token.value}`;
    this.answer("", "");
    try {
      const override = action === "override" ? { despite_diagnosis: true } : {};
      const response = await fetch(`/api/${action === "override" ? "approve" : action}`, {
        method: "POST",
        headers,
        body: JSON.stringify({ ...(imus.length ? { imus } : {}), ...override }),
        signal: AbortSignal.timeout(WAIT_MS),
      });
      const answer = await response.json();
      if (response.ok) return this.answer(answer.done, "");
      this.answer(`${LABELS[action]}: ${answer.error.message}`, "bad");
      if (response.status === 401) {
        byId("token").open = true;
        this.token.focus();
      }
    } catch (error) {
      this.answer(`${LABELS[action]}: the service does not answer (${error.message})`, "bad");
    }
  }

  answer(text, kind) {
    const result = byId("push-result");
    result.classList.toggle("bad", kind === "bad");
    say(result, text && capital(text));
  }
}

// A proposal that would change nothing: there is nothing to approve.
function same(proposal, title, state) {
  return h(
    "div",
    { class: "proposal", "data-imu": proposal.imu },
    h("h3", { text: title }),
    h("p", { class: "soft", text: capital(`${state.sentence}.`) }),
    h("details", { "data-key": `same-${proposal.imu}` }, h("summary", { text: "The numbers" }), changesTable(proposal.changes)),
  );
}

// A write that has not come to its end: which values are in force, and what to do.
function notEnded(one) {
  const decimals = ({ name }) => (name.includes("SCAL") ? 5 : 4);
  const which = ({ before, written, now }) => (now === null ? "not known yet" : now === written ? "new" : now === before ? "old" : "somebody's");
  return h(
    "div",
    { class: "unfinished", "data-imu": one.imu },
    h("h3", { class: one.half === false ? "" : "bad", text: `IMU ${one.imu}: ${one.half ? "half a set is in force" : "a write was interrupted"}` }),
    h("p", { text: capital(`${one.sentence}.`) }),
    ...(one.next ? [h("p", { class: "bad", text: capital(`${one.next}.`) })] : []),
    h("div", { class: "scroll" }, h(
      "table",
      { class: "changes" },
      h("thead", {}, h("tr", {}, h("th", { scope: "col", text: "Parameter" }), ...["old", "new", "in force"].map((text) => h("th", { scope: "col", class: "number", text })))),
      h("tbody", {}, ...one.values.map((value) => h(
        "tr",
        {},
        h("td", { class: "name", text: value.name }),
        ...[value.before, value.written].map((number) => h("td", { class: "number", text: fixed(number, decimals(value)) })),
        h("td", { class: "number to", text: value.now === null ? which(value) : `${fixed(value.now, decimals(value))} (${which(value)})` }),
      ))),
    )),
  );
}

// What the diagnosis has against writing a proposal, empty if nothing.
function against(proposal) {
  const held = proposal?.held_back ?? {};
  const name = DIAGNOSIS.find((reason) => reason in held);
  return name ? held[name] : "";
}

function changesTable(changes) {
  const decimals = (change) => (change.name.includes("SCAL") ? 4 : 3);
  return h(
    "div",
    { class: "scroll" },
    h(
      "table",
      { class: "changes" },
      h("thead", {}, h("tr", {}, h("th", { scope: "col", text: "Parameter" }), h("th", { scope: "col", class: "number", text: "before" }), h("th", { scope: "col", class: "number", text: "after" }), h("th", { scope: "col", class: "number", text: "±" }))),
      h("tbody", {}, ...changes.map((change) =>
        h(
          "tr",
          { class: change.kept ? "kept" : "" },
          h("td", { class: "name", text: change.name }),
          h("td", { class: "number", text: fixed(change.before, decimals(change)) }),
          h("td", { class: "number to", text: change.kept ? "kept" : fixed(change.after, decimals(change)) }),
          h("td", { class: "number soft", text: change.kept ? "" : brief(change.sigma, 2) }),
        ),
      )),
    ),
  );
}
