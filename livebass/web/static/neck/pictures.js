// Draws the strings over the neck, the last string from the side, the last note, and the spectrum. Contacts of the last
// moments are sparks (`drawNeck`, `drawCrowns`), those of the last note dots (`drawNote`). Without sound nothing is drawn
// again.
import {FULL_SPEED, POINTS, SHOWN} from "./see.js";

const NOTE_SPAN = 1000 * SHOWN.after; // ms in the last note's picture
/** @type {[number, string][]} */ // of the spectrum
const MARKS = [[50, "50"], [100, "100"], [200, "200"], [500, "500"], [1000, "1 kHz"], [2000, "2"], [5000, "5"]];
const LOWEST_HZ = 30, HIGHEST_HZ = 10000, MIN_DB = -110; // of the spectrum
const LANE_PART = 0.46; // of the distance to the next string: a string's greatest drawn displacement
const NARROW = 280; // px, the width of a spectrum without room for all names
const MM = 1e-3;
const INLAYS = [1, 3, 5, 7, 9, 12, 15, 17, 19, 21, 24]; // frets with a number
const STEPS = [0.5, 1, 2, 5, 10, 20]; // mm, between the side view's lines

// Draws a straight line.
function line(g, x0, y0, x1, y1) {
  g.beginPath();
  g.moveTo(x0, y0);
  g.lineTo(x1, y1);
  g.stroke();
}

// Draws a spark: rays around a point, `r` px long.
function spark(g, x, y, r) {
  g.beginPath();
  for (let k = 0; k < 8; k++) {
    const angle = Math.PI * (k + 0.5) / 4, far = k % 2 ? r : 0.7 * r;
    g.moveTo(x + 0.25 * r * Math.cos(angle), y + 0.25 * r * Math.sin(angle));
    g.lineTo(x + far * Math.cos(angle), y + far * Math.sin(angle));
  }
  g.stroke();
}

// The highest level (dB) between two places in a spectrum, which has a level at each whole number. Where these are far apart,
// the level lies on the line that joins the two nearest.
export function levelIn(levels, from, to) {
  const at = k => Math.max(MIN_DB, levels[k]);
  let highest = MIN_DB;
  for (let k = Math.ceil(from); k <= to; k++) highest = Math.max(highest, at(k));
  if (to - from > 1) return highest;
  const k = Math.floor(from);
  return Math.max(highest, at(k) + (from - k) * (at(k + 1) - at(k)));
}

export class Pictures {
  // `canvases`: neck, side, note, spectrum, both; `see`: what they show.
  constructor(canvases, see) {
    /** @type {Record<string, HTMLCanvasElement>} */
    this.canvases = canvases;
    this.see = see;
    this.zoom = 20; // on the neck, at most
    /** @type {Place} */
    this.place = x => x;
    /** @type {(string: number) => number} */
    this.lane = i => i;
    this.whole = true; // all frets are on the neck
    const [neck, side, note] = Array.from({length: 3}, () => document.createElement("canvas"));
    this.parts = {neck, side, note}; // of a poster
    this.bins = new Float32Array(0); // of the spectrum
    /** @type {Float32Array[]} */
    this.both = []; // of the recorded and the computed note
    this.side = {x: (/** @type {number} */ place) => place, length: 1, above: 0, metre: 1, dpr: 1}; // how it was drawn
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
  }

  // Sets the neck's layout: `place` maps a place on a string (m from the nut) to CSS pixels, or to undefined where the
  // neck is not shown; `lane` maps a string to the middle of its lane; `whole`: all of the neck is shown.
  layOut(place, lane, whole) {
    Object.assign(this, {place, lane, whole});
    this.see.needed = true;
  }

  colours() {
    const style = getComputedStyle(document.documentElement), of = name => style.getPropertyValue(`--${name}`).trim();
    return {ink: of("ink"), soft: of("soft"), line: of("line"), edge: of("edge"), accent: of("accent"),
            ground: of("trough"), string: of("string"), shade: of("string-shade"), flash: of("flash"), other: of("other")};
  }

  // A canvas's context, cleared, at its shown size: [context, width, height, device pixels per pixel, and per pixel
  // that grows with the page's text].
  sheet(canvas) {
    const shown = canvas.isConnected, dpr = shown ? Math.min(2, devicePixelRatio || 1) : 2;
    const w = shown ? Math.max(1, Math.round(canvas.clientWidth * dpr)) : canvas.width;
    const h = shown ? Math.max(1, Math.round(canvas.clientHeight * dpr)) : canvas.height;
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    const g = canvas.getContext("2d");
    g.clearRect(0, 0, w, h);
    g.lineJoin = g.lineCap = "round";
    return [g, w, h, dpr, shown ? dpr * parseFloat(getComputedStyle(document.documentElement).fontSize) / 16 : dpr];
  }

  // Draws all visible pictures.
  draw(analyser) {
    const {see} = this;
    if (!see.needed || !see.bass) return;
    see.needed = false;
    const colour = this.colours();
    const shown = canvas => canvas.clientWidth > 0;
    if (shown(this.canvases.neck)) this.drawNeck(colour, this.place, this.lane);
    if (shown(this.canvases.side)) this.drawSide(colour);
    if (shown(this.canvases.note)) this.drawNote(colour);
    if (analyser && shown(this.canvases.spectrum)) this.drawSpectrum(colour, analyser);
    if (this.both.length && shown(this.canvases.both)) this.drawLevels(this.canvases.both, colour, this.both, [colour.other, colour.accent]);
  }

  // Motion is drawn, except where it is not wanted and nobody asked for a replay or holds a string.
  get moves() { return !this.still.matches || this.see.replay !== undefined || this.see.held !== undefined; }

  // --- the neck, from above ---

  // px from one string to the next; with a single string, the whole `height`.
  gap(lane, height) {
    const many = this.see.bass.strings.length;
    return Math.abs(lane(0) - lane(many - 1)) / Math.max(1, many - 1) || height;
  }

  // px a metre along the neck: the scale of its motion, too.
  metre(place) {
    const {length} = this.see.bass.strings[0], bridge = place(length);
    return (bridge - place(0.9 * length)) / (0.1 * length);
  }

  // The zoom on the neck: so much that the last note's motion stays within its lane.
  drawnZoom(place, gap) {
    return Math.max(1, Math.min(this.zoom, Math.floor(LANE_PART * gap / (this.see.reach.across * this.metre(place)))));
  }

  get magnified() { return this.drawnZoom(this.place, this.gap(this.lane, this.canvases.neck.clientHeight)); }

  // Draws strings, and sparks at the frets that they hit, over the page's board.
  drawNeck(colour, place, lane) {
    const [g, , h, dpr] = this.sheet(this.canvases.neck), {see} = this, {strings} = see.bass;
    const gap = this.gap(lane, h / dpr), enlarged = this.drawnZoom(place, gap) * this.metre(place);
    /** @type {Map<number, [Path2D, string][]>} */
    const moving = new Map();
    const add = (tint) => ({string, length, v}) => {
      const scale = strings[string].length, middle = lane(string);
      const along = k => k < 0 ? place(0) : place(scale - length + length * k / POINTS);
      const path = this.pathOf(along, k => middle - (k < 0 ? 0 : v[k] * enlarged), dpr);
      moving.set(string, [...(moving.get(string) || []), [path, tint]]);
    };
    if (see.other) see.drawReplay(see.other, see.other.at, add(colour.other));
    if (this.moves) see.eachString(add(colour.string));
    strings.forEach((string, i) => {
      const wide = dpr * Math.max(1.5, 1.8 * string.gauge), along = k => place(string.length * Math.max(0, k) / POINTS);
      const rest = () => this.pathOf(along, () => lane(i), dpr);
      for (const [path, tint] of moving.get(i) || [[rest(), colour.string]]) {
        g.lineWidth = wide + 2 * dpr;
        g.strokeStyle = colour.shade;
        g.stroke(path);
        g.lineWidth = wide;
        g.strokeStyle = tint;
        g.stroke(path);
      }
    });
    g.strokeStyle = g.fillStyle = colour.flash;
    for (const {string, fret, strength, bright} of see.flashes.values()) {
      const x = place(this.placeOf(string, fret));
      if (x === undefined) continue;
      const r = dpr * gap * (0.2 + 0.28 * strength);
      g.globalAlpha = bright;
      g.lineWidth = 2 * dpr;
      g.beginPath();
      g.arc(dpr * x, dpr * lane(string), 0.3 * r, 0, 2 * Math.PI);
      g.fill();
      spark(g, dpr * x, dpr * lane(string), r);
    }
    g.globalAlpha = 1;
  }

  // The path of a string from the nut (k = -1) to the saddle, with gaps where its place is not shown.
  pathOf(place, height, dpr) {
    const path = new Path2D();
    let drawn = false;
    for (let k = -1; k <= POINTS; k++) {
      const x = place(k);
      if (x === undefined) drawn = false;
      else if (drawn) path.lineTo(dpr * x, dpr * height(k));
      else path.moveTo(dpr * x, dpr * height(k));
      drawn = x !== undefined;
    }
    return path;
  }

  // A contact's place, m from the nut: at a fret, or anywhere on a board.
  placeOf(string, fret) {
    return this.see.bass.fretless ? fret : this.see.bass.strings[string].frets[fret - 1];
  }

  // --- the side ---

  // Draws the last string from the side: nut, crowns with their numbers, finger, pickups and saddle; an axis in mm.
  drawSide(colour) {
    const {see} = this, {string} = see.note, s = see.bass.strings[string];
    const [g, w, h, dpr, px] = this.sheet(this.canvases.side), foot = 17 * px;
    const left = 48 * px, x = this.sidePlace(s, left, w, dpr, px);
    const lowest = Math.min(...s.heights, ...see.other?.heights || []), above = 1.15 * see.reach.above + 0.1 * MM;
    const below = Math.min(1.1 * see.reach.below, lowest - 0.25 * MM);
    const y = height => (h - foot) * (above - height) / (above - below);
    if (this.canvases.side.isConnected) this.side = {x, length: s.length, above, metre: (h - foot) / (above - below), dpr};
    g.font = `${11 * px}px system-ui, sans-serif`;
    g.textBaseline = "middle";
    this.drawHeights(g, colour, y, below / MM, above / MM, x(0) - 12 * px, w, px);
    this.drawBelow(g, colour, s, x, h - foot, px);
    this.drawCrowns(g, colour, string, x, y, h - foot, px);
    const trace = (tint, heights = s.heights) => ({string: i, fret, length, u}) => {
      if (i !== string || drawn) return;
      drawn = true;
      const choked = see.crownOf(s, length, fret) > fret; // from the pressed fret on the string lies still
      const [stop, top] = choked ? [s.frets[fret - 1], heights[fret - 1]] : [s.length - length, u[0]];
      g.strokeStyle = tint;
      g.lineWidth = 2 * px;
      g.beginPath();
      if (choked) g.lineTo(x(stop), y(top));
      const {held} = see, grip = held && POINTS * held.place / length;
      for (let k = 0; k <= POINTS; k++) {
        g.lineTo(x(s.length - length + length * k / POINTS), y(u[k]));
        if (held && grip !== undefined && k <= grip && grip < k + 1) g.lineTo(x(s.length - length + held.place), y(held.height));
      }
      g.stroke();
      if (held) this.drawHand(g, colour, x(s.length - length + held.place), y(held.height), px);
      if (fret) this.drawFinger(g, colour, x(stop), y(top), x(0), px);
    };
    let drawn = false;
    if (see.other) see.drawReplay(see.other, see.other.at, trace(colour.other, see.other.heights));
    drawn = false;
    if (this.moves) see.eachString(trace(colour.ink));
    if (drawn) return;
    g.strokeStyle = colour.ink;
    g.lineWidth = 2 * px;
    line(g, x(0), y(0), x(s.length), y(0));
  }

  // Maps a place on the string to the side view's px: under the neck's frets where the neck is as wide, and whole.
  sidePlace(s, left, w, dpr, px) {
    const {side, neck} = this.canvases, beside = side.clientWidth - neck.clientWidth;
    if (side.isConnected && this.whole && beside * dpr >= left && beside * dpr < 2 * left)
      return place => dpr * ((this.place(place) || 0) + beside);
    return place => left + (w - left - 8 * px) * place / s.length;
  }

  // Lines of equal height.
  drawHeights(g, colour, y, below, above, left, w, px) {
    const maximum = Math.max(3, Math.abs(y(below * MM) - y(above * MM)) / (22 * px));
    const step = STEPS.find(mm => (above - below) / mm < maximum) || 50;
    g.lineWidth = px;
    g.textAlign = "right";
    for (let k = Math.ceil(below / step); k * step <= above; k++) {
      const at = y(k * step * MM);
      g.strokeStyle = k ? colour.line : colour.edge;
      line(g, left + 8 * px, at, w, at);
      g.fillStyle = colour.soft;
      if (at > 8 * px) g.fillText(k ? k * step : "0 mm", left, at);
    }
  }

  // Pickups and fret numbers, at the foot.
  drawBelow(g, colour, s, x, foot, px) {
    const {pickups, capo} = this.see.bass;
    g.fillStyle = colour.edge;
    for (const {position, aperture, strings} of pickups) {
      if (!strings.some(i => this.see.bass.strings[i] === s)) continue;
      const wide = Math.max(10 * px, x(aperture) - x(0));
      g.fillRect(x(s.length - position) - wide / 2, foot - 9 * px, wide, 9 * px);
    }
    g.fillStyle = colour.soft;
    g.textAlign = "center";
    let free = -Infinity;
    for (const [k, place] of s.frets.entries()) {
      const fret = capo + k + 1;
      if (!INLAYS.includes(fret) || x(place) < free) continue;
      g.fillText(fret, x(place), foot + 9 * px);
      free = x(place) + 16 * px;
    }
    for (const {position, strings} of pickups) {
      if (!strings.some(i => this.see.bass.strings[i] === s) || x(s.length - position) < free) continue;
      g.fillText("pickup", x(s.length - position), foot + 9 * px);
      free = x(s.length - position) + 48 * px;
    }
  }

  // Nut, crowns or board, and saddle; sparks at the hits.
  drawCrowns(g, colour, string, x, y, foot, px) {
    const {fretless} = this.see.bass, s = this.see.bass.strings[string];
    g.fillStyle = colour.soft;
    for (const place of [0, s.length]) g.fillRect(x(place) - 3 * px, y(0), 6 * px, foot - y(0));
    if (fretless) {
      g.beginPath();
      s.frets.forEach((place, k) => g.lineTo(x(place), y(s.heights[k])));
      g.lineTo(x(/** @type {number} */ (s.frets.at(-1))), foot);
      g.lineTo(x(s.frets[0]), foot);
      g.globalAlpha = 0.5;
      g.fill();
      g.globalAlpha = 1;
    } else {
      s.frets.forEach((place, k) => g.fillRect(x(place) - 1.5 * px, y(s.heights[k]), 3 * px, foot - y(s.heights[k])));
    }
    g.lineWidth = 2 * px;
    g.strokeStyle = colour.other;
    const before = this.see.other?.heights || s.heights;
    s.frets.forEach((place, k) => {
      if (before[k] !== s.heights[k]) line(g, x(place) - 5 * px, y(before[k]), x(place) + 5 * px, y(before[k]));
    });
    g.strokeStyle = g.fillStyle = colour.accent;
    for (const {string: of, fret, strength, bright} of this.see.flashes.values()) {
      if (of !== string) continue;
      const at = x(this.placeOf(string, fret));
      const nearest = fretless ? s.frets.findIndex(place => place >= fret) : fret - 1;
      const top = y(s.heights[nearest] ?? s.heights[s.heights.length - 1]);
      g.globalAlpha = bright;
      if (!fretless) g.fillRect(at - 2 * px, top, 4 * px, foot - top);
      spark(g, at, top, px * (7 + 9 * strength));
    }
    g.globalAlpha = 1;
  }

  // The finger that holds the string down, just behind its fret.
  drawFinger(g, colour, x, y, nut, px) {
    const wide = Math.min(9 * px, Math.max(4 * px, (x - nut) / 3));
    g.fillStyle = colour.accent;
    g.globalAlpha = 0.85;
    g.beginPath();
    g.ellipse(x - wide - 2 * px, y - 6 * px, wide, 6 * px, 0, 0, 2 * Math.PI);
    g.fill();
    g.globalAlpha = 1;
  }

  // The hand that pulls the string.
  drawHand(g, colour, x, y, px) {
    g.fillStyle = colour.accent;
    g.beginPath();
    g.arc(x, y, 5 * px, 0, 2 * Math.PI);
    g.fill();
  }

  // The place (m from the nut) and the height (m) of a point of the side view as drawn last, in CSS px.
  sideAt(x, y) {
    const {x: along, length, above, metre, dpr} = this.side;
    let [low, high] = [0, length];
    for (let k = 0; k < 40; k++) {
      const middle = (low + high) / 2;
      if (along(middle) < x * dpr) low = middle;
      else high = middle;
    }
    return {place: low, height: above - y * dpr / metre};
  }

  // The point of the side view, in CSS px, for a place and a height.
  sidePoint(place, height) {
    const {x, above, metre, dpr} = this.side;
    return {x: x(place) / dpr, y: (above - height) * metre / dpr};
  }

  // --- the last note and the spectrum ---

  // Draws the last note's hits from its release on: time to the right, frets upwards.
  drawNote(colour) {
    const {see} = this, {string, frame, contacts} = see.note, [g, w, h, , px] = this.sheet(this.canvases.note);
    const s = see.bass.strings[string], left = 34 * px, foot = 18 * px, count = s.frets.length;
    const far = see.bass.fretless ? s.length : count + 0.5;
    const x = ms => left + (w - left - 8 * px) * ms / NOTE_SPAN, y = fret => (h - foot) * (1 - fret / far);
    g.font = `${11 * px}px system-ui, sans-serif`;
    g.fillStyle = colour.soft;
    g.strokeStyle = colour.line;
    g.lineWidth = px;
    g.textBaseline = "middle";
    g.textAlign = "right";
    for (const fret of [5, 12, 17].filter(n => n <= count)) {
      const at = y(see.bass.fretless ? s.frets[fret - 1] : fret);
      line(g, left, at, w, at);
      g.fillText(see.bass.fretless ? String(Math.round(s.frets[fret - 1] / MM)) : String(see.bass.capo + fret), left - 5 * px, at);
    }
    g.textAlign = "left";
    g.fillText(see.bass.fretless ? "mm from the nut" : "fret", left + 4 * px, 8 * px);
    g.textAlign = "center";
    for (let ms = 0; ms <= NOTE_SPAN; ms += 20) {
      const text = ms === NOTE_SPAN ? `${ms} ms` : String(ms);
      g.fillText(text, Math.min(x(ms), w - g.measureText(text).width / 2 - 5 * px), h - foot / 2);
    }
    if (frame === undefined) return;
    if (see.replay) {
      const at = x(Math.max(0, Math.min(NOTE_SPAN, see.moment)));
      g.strokeStyle = colour.ink;
      line(g, at, 0, at, h - foot);
    }
    const dots = (tint, begin, hits) => {
      g.fillStyle = tint;
      for (const {fret, frame: at, speed} of hits) {
        const ms = 1000 * (at - begin) / see.rate, r = px * (1.2 + 3.8 * Math.min(1, Math.sqrt(speed / FULL_SPEED)));
        if (ms > NOTE_SPAN || ms < 0) continue;
        g.globalAlpha = 0.8;
        g.beginPath();
        g.arc(x(ms), y(Math.min(fret, far)), r, 0, 2 * Math.PI);
        g.fill();
      }
    };
    if (see.other) dots(colour.other, see.other.frame, see.other.hits);
    dots(colour.accent, frame, contacts);
    g.globalAlpha = 1;
  }

  drawSpectrum(colour, analyser) {
    if (!this.bins.length) this.bins = new Float32Array(analyser.frequencyBinCount);
    analyser.getFloatFrequencyData(this.bins);
    this.drawLevels(this.canvases.spectrum, colour, [this.bins], [colour.accent]);
  }

  // Draws levels (dB) of sounds over frequency, each in its tint.
  drawLevels(canvas, colour, sounds, tints) {
    const [g, w, h, , px] = this.sheet(canvas), foot = 18 * px;
    const bin = this.see.rate / 2 / sounds[0].length, ratio = HIGHEST_HZ / LOWEST_HZ;
    g.font = `${11 * px}px system-ui, sans-serif`;
    g.fillStyle = colour.soft;
    g.strokeStyle = colour.line;
    g.textAlign = "center";
    g.textBaseline = "middle";
    const every = w < NARROW * px ? 2 : 1;
    for (const [k, [hz, text]] of MARKS.entries()) {
      const x = w * Math.log(hz / LOWEST_HZ) / Math.log(ratio);
      line(g, x, 0, x, h - foot);
      if (k % every === 0) g.fillText(text, x, h - foot / 2);
    }
    g.lineWidth = 1.5 * px;
    for (const [i, bins] of sounds.entries()) {
      g.strokeStyle = tints[i];
      g.beginPath();
      for (let x = 0; x < w; x += 2 * px) {
        const from = LOWEST_HZ * ratio ** (x / w) / bin, to = LOWEST_HZ * ratio ** ((x + 2 * px) / w) / bin;
        g.lineTo(x, (h - foot) * Math.max(0, levelIn(bins, from, to) / MIN_DB));
      }
      g.stroke();
    }
  }

  // --- a poster ---

  // Draws neck, side and last note into `canvas`, with a line of text above and one below: a picture to save.
  poster(canvas, title, foot) {
    const g = canvas.getContext("2d"), [w, h] = [canvas.width, canvas.height], colour = this.colours(), edge = w / 40;
    const {neck, side, note} = this.parts, of = this.canvases, tall = (h - 6.4 * edge) / 2, {strings} = this.see.bass;
    Object.assign(neck, {width: w - 2 * edge, height: 0.8 * tall});
    Object.assign(side, {width: (w - 3 * edge) * 0.62, height: 1.2 * tall});
    Object.assign(note, {width: (w - 3 * edge) * 0.38, height: 1.2 * tall});
    const scale = Math.max(...strings.map(string => string.length));
    const place = x => (neck.width / 2) * (0.015 + 0.97 * x / scale);
    const lane = i => (neck.height / 2) * (strings.length - 0.5 - i) / strings.length;
    this.canvases = this.parts;
    this.drawNeck(colour, place, lane);
    this.drawSide(colour);
    this.drawNote(colour);
    this.canvases = of;
    g.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--ground");
    g.fillRect(0, 0, w, h);
    g.textBaseline = "middle";
    const lines = [[title, 1.25 * edge, 0.62, colour.ink], [foot, h - 0.9 * edge, 0.45, colour.soft]];
    for (const [text, y, size, tint] of lines) {
      g.fillStyle = tint;
      g.font = `${edge * size}px system-ui, sans-serif`;
      g.fillText(text, edge, y, w - 2 * edge);
    }
    this.drawBoard(g, edge, 2 * edge, neck.width, neck.height, x => 2 * place(x), strings[0]);
    g.drawImage(neck, edge, 2 * edge);
    for (const {part, x} of [{part: side, x: edge}, {part: note, x: 2 * edge + side.width}]) {
      g.fillStyle = colour.ground;
      g.fillRect(x, 3 * edge + neck.height, part.width, part.height);
      g.drawImage(part, x, 3 * edge + neck.height);
    }
  }

  // Draws the board, with or without frets, and the pickups beyond it, as behind the page's strings.
  drawBoard(g, left, top, width, height, place, {frets, length}) {
    const {bass} = this.see, end = place(frets.at(-1) + 0.008);
    g.fillStyle = "#5d1c0c";
    g.fillRect(left, top, width, height);
    g.fillStyle = "#432717";
    g.fillRect(left + place(0), top, end - place(0), height);
    g.fillStyle = bass.fretless ? "#cbb38b66" : "#b5b0a6";
    for (const fret of frets) g.fillRect(left + place(fret) - 2, top, 4, height);
    g.fillStyle = "#f7efdc";
    g.fillRect(left + place(0) - 4, top, 8, height);
    g.fillStyle = "#171412";
    for (const {position, aperture, strings} of bass.pickups) {
      const many = bass.strings.length, row = height / many, last = Math.max(...strings);
      const wide = Math.max(12, place(aperture) - place(0)), tall = row * (last - Math.min(...strings) + 1);
      g.fillRect(left + place(length - position) - wide / 2, top + row * (many - 1 - last), wide, tall);
    }
  }
}
