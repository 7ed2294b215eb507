// Small things about the document: elements, and changes that touch only what is different.

/** An element; `attributes` may hold class, text, and on<event> functions. */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name === "text") element.textContent = value;
    else if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}

export const byId = (id) => document.getElementById(id);

/** Set the text only if it is another: a reader that speaks must not repeat itself. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Set one of the tones good, warn, bad (or none) on an element. */
export function tone(element, wanted) {
  for (const name of ["good", "warn", "bad"]) element.classList.toggle(name, name === wanted);
}

/** Rebuild the inside of `element` only when what it shows has changed; keeps focus and scroll. */
export function renew(element, shown, build) {
  const key = JSON.stringify(shown);
  if (element.shownKey === key) return;
  element.shownKey = key;
  const focused = element.contains(document.activeElement) ? document.activeElement.dataset.key : null;
  const opened = [...element.querySelectorAll("details[open]")].map((e) => e.dataset.key);
  element.replaceChildren(...build());
  for (const key of opened) {
    const again = element.querySelector(`details[data-key="${key}"]`);
    if (again) again.open = true;
  }
  if (focused) element.querySelector(`[data-key="${focused}"]`)?.focus();
}
