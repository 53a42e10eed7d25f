// What every part of the page uses.

export const byId = name => document.getElementById(name);

export function make(name, values = {}, text = null) {
  const item = Object.assign(document.createElement(name), values);
  if (text !== null) item.textContent = text;
  return item;
}

/** Open a dialog; the browser's button "back" closes it. */
export function openDialog(dialog) {
  dialog.showModal();
  history.pushState({ dialog: dialog.id }, "");
  dialog.addEventListener("close", () => { if (history.state && history.state.dialog === dialog.id) history.back(); }, { once: true });
}

/** Show a sentence about a problem, or hide it. */
export function say(place, text) {
  place.textContent = text;
  place.hidden = !text;
}

/** The server's answer; its sentence as an error where it refuses. */
export async function ask(address, how = {}) {
  let answer;
  try { answer = await fetch(address, how); } catch { throw new Error("The server does not answer."); }
  let said;
  try { said = await answer.json(); } catch { said = {}; }
  if (!answer.ok) {
    const text = said.problem || `The server refuses this (${answer.status}).`;
    throw new Error(text[0].toUpperCase() + text.slice(1));
  }
  return said;
}

/** Seconds as people say them. */
export function duration(seconds) {
  if (seconds < 90) return `${Math.max(1, Math.round(seconds))} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 90 ? `${minutes} min` : `${(minutes / 60).toFixed(1)} h`;
}

export function size(bytes) {
  return bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}
