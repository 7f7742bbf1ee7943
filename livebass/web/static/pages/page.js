// Shared by all parts of the page: its elements, the export's data, and the chosen bass.

/** @type {GetElement} */
export const $ = /** @type {any} */ (document.getElementById.bind(document));

/** @type {PageData} */
export const PAGE = JSON.parse($("page").textContent);

// The address that others can open, without the part after its #; "": this page is on a computer of its own.
export const ADDRESS = PAGE.address || (location.protocol === "https:" ? location.origin + location.pathname : "");

export const NAMES = ["C", "C♯", "D", "D♯", "E", "F", "F♯", "G", "G♯", "A", "A♯", "B"];

/** @param {number} note */
export const noteName = note => NAMES[note % 12] + (Math.floor(note / 12) - 1);

export const saying = {lasts: 8000, timer: 0}; // ms that a message stays; the timer of the last one

// Shows a message over the page's lower edge, for a while or until the next one.
export function say(/** @type {string} */ text, stays = false) {
  clearTimeout(saying.timer);
  $("said").replaceChildren(...text ? [make("span", {textContent: text})] : []); // a new box: the old one does not move
  if (!stays) saying.timer = setTimeout(() => $("said").replaceChildren(), saying.lasts);
}

/** @param {string} name @returns {Bass} */
export const bassCalled = name => /** @type {Bass} */ (PAGE.basses.find(bass => bass.name === name));

// The chosen bass; the one before may still ring.
export const chosenBass = () => bassCalled($("bass").value);

// Chooses another bass, as by hand.
export function chooseBass(/** @type {string} */ name) {
  if ($("bass").value === name) return;
  $("bass").value = name;
  $("bass").dispatchEvent(new Event("change"));
}

/**
 * A new element with these properties and children.
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {object} properties
 * @param {(Node | string)[]} children
 */
export function make(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

/** @param {string} text @param {object} properties */
export const makeButton = (text, properties) => make("button", {type: "button", textContent: text, ...properties});

/** @param {Element} button */
export const isPressed = button => button.getAttribute("aria-pressed") === "true";

export function setPressed(/** @type {Element} */ button, /** @type {boolean} */ on) {
  button.setAttribute("aria-pressed", String(on));
}

// Shows on a button that its press is being carried out; returns what that makes.
/** @template T @param {Element} button @param {Promise<T>} work */
export async function busy(button, work) {
  button.ariaBusy = "true";
  return work.finally(() => { button.ariaBusy = null; });
}

// The memory of a tab beyond a reload; empty where browsers forbid it.
export const saved = {
  get(/** @type {string} */ name) {
    try {
      return sessionStorage.getItem(`livebass ${name}`);
    } catch {
      return null;
    }
  },
  set(/** @type {string} */ name, /** @type {string} */ value) {
    try {
      sessionStorage.setItem(`livebass ${name}`, value);
    } catch { /* it forgets */ }
  },
};

// Saves a file as a download.
export function save(/** @type {Blob} */ blob, /** @type {string} */ name) {
  const link = make("a", {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
