// Draws the strings: their shapes from their modes, and the frets that they hit. Pictures follow the sound that is
// heard, not the sound that is computed. Without sound nothing is redrawn.
const POINTS = 160; // steps of a drawn string
const MOST_SIGHTS = 8; // waiting for their sound
const NOTE_SPAN = 80; // ms in the last note's picture
/** @type {[number, string][]} */
const MARKS = [[50, "50"], [100, "100"], [200, "200"], [500, "500"], [1000, "1 kHz"], [2000, "2"], [5000, "5"]]; // of the spectrum
const LOWEST_HZ = 30, HIGHEST_HZ = 10000, LEAST_DB = -110; // of the spectrum
const FULL_SPEED = 4; // m/s of a string whose hit is drawn at full strength
const FADE = 0.86; // of a flash from one picture to the next, at 60 per second
const HELD_FLASH = 300; // ms that a flash stays if motion is not wanted
const LANE_PART = 0.48; // of the distance to the next string: a string's greatest drawn displacement
const NARROW = 280; // px, the width of a spectrum without room for all names
const SOME = 48; // frames between measured shapes
const MM = 1e-3;

// Draws a straight line.
function line(g, x0, y0, x1, y1) {
  g.beginPath();
  g.moveTo(x0, y0);
  g.lineTo(x1, y1);
  g.stroke();
}

// A sound's fundamental (Hz), by McLeod's normalised square difference over the last samples; undefined: none.
export function pitchOf(sound, rate) {
  const every = Math.max(1, Math.round(rate / 12000)), n = Math.floor(sound.length / every), x = new Float32Array(n);
  for (let k = 0; k < n; k++) {
    let sum = 0;
    for (let j = 0; j < every; j++) sum += sound[k * every + j];
    x[k] = sum / every;
  }
  let energy = 0;
  for (const value of x) energy += value * value;
  if (energy / n < 1e-7) return undefined;
  const least = Math.floor(rate / every / 420), most = Math.ceil(rate / every / 28), like = new Float32Array(most + 2);
  const room = n - most - 2;
  for (let lag = least - 1; lag < like.length; lag++) {
    let product = 0, square = 0;
    for (let k = 0; k < room; k++) {
      product += x[k] * x[k + lag];
      square += x[k] * x[k] + x[k + lag] * x[k + lag];
    }
    like[lag] = 2 * product / (square || 1);
  }
  const highest = like.reduce((a, b) => Math.max(a, b));
  if (highest < 0.6) return undefined;
  for (let lag = least; lag <= most; lag++) {
    const [a, b, c] = [like[lag - 1], like[lag], like[lag + 1]];
    if (b < 0.92 * highest || b < a || b < c) continue;
    return rate / every / (lag + (a - c) / (2 * (a - 2 * b + c) || 1));
  }
  return undefined;
}

export class See {
  // `canvases`: neck, side, note, spectrum; `records`: SIGHT and SLOT_SIGHT, as the kernels lay them out; `told` is
  // called half a second after a note, with a line for people who cannot see.
  constructor(canvases, records, told) {
    /** @type {Record<string, HTMLCanvasElement>} */
    this.canvases = canvases;
    /** @type {(line: string) => void} */
    this.told = told;
    /** @type {RecordFields} */
    this.record = records.SIGHT;
    /** @type {RecordFields & {seen: number}} */
    this.slot = records.SLOT_SIGHT;
    this.seen = this.slot.seen;
    this.sines = new Float32Array((POINTS + 1) * this.seen);
    for (let k = 0; k <= POINTS; k++)
      for (let j = 0; j < this.seen; j++) this.sines[k * this.seen + j] = Math.sin(Math.PI * (j + 1) * k / POINTS);
    this.rate = 48000; // Hz
    this.zoom = 20;
    /** @type {Bass} */
    this.bass = /** @type {any} */ (undefined);
    /** @type {DataView<ArrayBuffer> | undefined} */
    this.view = undefined; // of the drawn sight
    /** @type {Replay | undefined} */
    this.replay = undefined;
    /** @type {(place: number) => number} */
    this.place = x => x;
    /** @type {(string: number) => number} */
    this.lane = i => i;
    /** @type {{frame: number, buffer: ArrayBuffer}[]} */
    this.sights = []; // the oldest first
    /** @type {Hit[]} */
    this.waiting = []; // contacts not heard yet
    /** @type {{string: number, fret: number, frame: number}[]} */
    this.plucks = []; // notes not heard yet
    /** @type {Map<string, {bright: number, since: number}>} */
    this.flashes = new Map(); // by "string fret"
    /** @type {SeenNote} */
    this.note = {string: 0, contacts: []}; // the last one
    this.shape = new Float32Array(POINTS + 1);
    const [neck, side, note] = Array.from({length: 3}, () => document.createElement("canvas"));
    this.parts = {neck, side, note}; // of a poster
    this.bins = new Float32Array(0); // of the spectrum
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    this.needed = true; // something must be redrawn
  }

  // Takes the strings, frets and pickups of another bass.
  setBass(bass) {
    this.bass = bass;
    this.sights.length = this.waiting.length = this.plucks.length = 0;
    this.flashes.clear();
    this.note = {string: 0, contacts: []};
    this.view = undefined;
    this.needed = true;
  }

  // Takes a sight of the audio thread at a frame; returns a buffer that it can reuse, or undefined.
  take({sight, frame, contacts, notes}) {
    for (let k = 0; k < notes.length; k += 3)
      this.plucks.push({string: notes[k], fret: notes[k + 1], frame: notes[k + 2]});
    for (let k = 0; k < contacts.length; k += 4)
      this.waiting.push({string: contacts[k], fret: contacts[k + 1], frame: contacts[k + 2], speed: contacts[k + 3]});
    this.sights.push({frame, buffer: sight});
    return this.sights.length > MOST_SIGHTS ? this.sights.shift()?.buffer : undefined;
  }

  // A field of slot `index` of a string in the drawn sight.
  read(string, index, name) {
    if (!this.view) return 0;
    const at = string * this.record.bytes + this.record.fields.slot[0] + index * this.slot.bytes + this.slot.fields[name][0];
    return this.slot.fields[name][1] === "f8" ? this.view.getFloat64(at, true) : Number(this.view.getBigInt64(at, true));
  }

  // Calls draw({string, fret, length, u}) for each sounding part of a string; u: m, (POINTS + 1), stop to saddle.
  eachString(draw) {
    if (this.replay) {
      const {rows, slots, at, string} = this.replay, k = Math.floor(at), [length, stop, fret] = slots.subarray(3 * k, 3 * k + 3);
      if (length) draw({string, fret, length, u: this.shapeOf(rows.subarray(k * this.seen, (k + 1) * this.seen), this.seen, length, stop)});
      return;
    }
    if (!this.view) return;
    for (let string = 0; string < this.bass.strings.length; string++)
      for (let index = 0; index < 2; index++) {
        if (!this.read(string, index, "on")) continue;
        const at = string * this.record.bytes + this.record.fields.slot[0] + index * this.slot.bytes;
        const q = new Float32Array(this.view.buffer, at + this.slot.fields.u[0], this.seen);
        const length = this.read(string, index, "length");
        this.shapeOf(q, Math.min(this.seen, this.read(string, index, "modes")), length, this.read(string, index, "stop"));
        draw({string, fret: this.read(string, index, "fret"), length, u: this.shape});
      }
  }

  // u (m) from amplitudes `q` on a string of `length` m with its stop at `stop` m.
  shapeOf(q, modes, length, stop) {
    const scale = Math.sqrt(2 / length), {seen, sines, shape} = this;
    for (let k = 0; k <= POINTS; k++) {
      let u = 0;
      for (let j = 0, at = k * seen; j < modes; j++) u += q[j] * sines[at + j];
      shape[k] = scale * u + stop * (1 - k / POINTS);
    }
    return shape;
  }

  // --- time ---

  // Advances to the frame heard now: its newest sight, the contacts until then. Returns the previous sight's buffer for
  // reuse, or undefined.
  follow(frame, now) {
    let newest;
    const before = this.view?.buffer;
    while (this.sights.length && this.sights[0].frame <= frame) newest = this.sights.shift();
    if (newest) {
      this.view = new DataView(newest.buffer);
      this.needed = true;
    }
    while (this.plucks.length && this.plucks[0].frame <= frame) {
      const [pluck] = this.plucks.splice(0, 1);
      this.note = {...pluck, contacts: [], said: false};
      this.needed = true;
    }
    const heard = this.waiting.filter(contact => contact.frame <= frame);
    if (heard.length) this.waiting = this.waiting.filter(contact => contact.frame > frame);
    for (const contact of heard) this.flash(contact, now);
    if (this.note.frame !== undefined && !this.note.said && frame > this.note.frame + this.rate / 2) this.tell();
    return newest && before;
  }

  flash(hit, now) {
    const {string, fret, frame, speed} = hit, key = `${string} ${fret}`, bright = Math.min(1, Math.sqrt(speed / FULL_SPEED));
    this.flashes.set(key, {bright: Math.max(bright, this.flashes.get(key)?.bright || 0), since: now});
    if (string === this.note.string && this.note.frame !== undefined && frame >= this.note.frame) this.note.contacts.push(hit);
    this.needed = true;
  }

  // Fades the flashes; if motion is not wanted, they stay for a moment and disappear.
  fade(now) {
    for (const [key, flash] of this.flashes) {
      if (this.still.matches ? now - flash.since > HELD_FLASH : (flash.bright *= FADE) < 0.04) this.flashes.delete(key);
      this.needed = true;
    }
  }

  // Describes the last note for people who cannot see it.
  tell() {
    this.note.said = true;
    const {contacts, string} = this.note, name = this.bass.strings[string].name;
    if (!contacts.length) return this.told(`${name} string: it touches nothing.`);
    const hardest = contacts.reduce((a, b) => a.speed >= b.speed ? a : b);
    const where = this.bass.fretless ? `${Math.round(1000 * hardest.fret)} mm from the stop` : `fret ${this.bass.capo + hardest.fret}`;
    return this.told(`${name} string: ${contacts.length} contact${contacts.length > 1 ? "s" : ""}, ${where} hit hardest.`);
  }

  // --- replay of the last note ---

  // Shows a motion made by `Engine.again`, from its first frame on.
  show(made) {
    /** @type {Hit[]} */
    const hits = [];
    for (let k = 0; k < made.contacts.length; k += 4) {
      const [string, fret, frame, speed] = made.contacts.slice(k, k + 4);
      hits.push({string, fret, frame, speed});
    }
    const replay = this.replay = {...made, hits, at: 0, length: made.slots.length / 3};
    const {string, frame} = made, contacts = hits.filter(hit => hit.frame >= frame);
    this.note = {string, fret: this.note.fret, frame, contacts, said: true};
    this.flashes.clear();
    this.needed = true;
    return replay;
  }

  // Goes to frame `at` of the replay; contacts on the way flash.
  goTo(at, now) {
    const r = this.replay, before = r?.at || 0;
    if (!r) return;
    r.at = Math.min(r.length - 1, Math.max(0, at));
    if (r.at < before) this.flashes.clear();
    for (const hit of r.hits) {
      const k = hit.frame - r.first;
      if (k > before && k <= r.at) this.flashes.set(`${hit.string} ${hit.fret}`, {bright: Math.min(1, Math.sqrt(hit.speed / FULL_SPEED)), since: now});
    }
    this.needed = true;
  }

  // The shown moment, ms after the release.
  get moment() { return this.replay ? 1000 * (this.replay.first + this.replay.at - this.replay.frame) / this.rate : 0; }

  leave() {
    this.replay = undefined;
    this.flashes.clear();
    this.needed = true;
  }

  // --- drawing ---

  colours() {
    const style = getComputedStyle(document.documentElement), of = name => style.getPropertyValue(`--${name}`).trim();
    return {ink: of("ink"), soft: of("soft"), line: of("line"), edge: of("edge"), accent: of("accent"), ground: of("trough"),
            string: of("string"), shade: of("string-shade"), flash: of("flash")};
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
    return [g, w, h, dpr, shown ? dpr * parseFloat(getComputedStyle(document.documentElement).fontSize) / 16 : dpr];
  }

  // Sets the neck's layout: `place` maps a place on a string (m from the nut) to CSS pixels, `lane` a string to the
  // middle of its lane.
  layOut(place, lane) {
    this.place = place;
    this.lane = lane;
    this.needed = true;
  }

  // Draws all visible pictures.
  draw(analyser) {
    if (!this.needed || !this.bass) return;
    this.needed = false;
    const colour = this.colours();
    const shown = canvas => canvas.clientWidth > 0;
    if (shown(this.canvases.neck)) this.drawNeck(colour, this.place, this.lane);
    if (shown(this.canvases.side)) this.drawSide(colour);
    if (shown(this.canvases.note)) this.drawNote(colour);
    if (analyser && shown(this.canvases.spectrum)) this.drawSpectrum(colour, analyser);
  }

  // Draws neck, side and last note into `canvas`, with a line of text above: a picture to save.
  poster(canvas, title) {
    const g = canvas.getContext("2d"), [w, h] = [canvas.width, canvas.height], colour = this.colours(), edge = w / 40;
    const {neck, side, note} = this.parts, of = this.canvases, tall = (h - 5 * edge) / 2;
    Object.assign(neck, {width: w - 2 * edge, height: tall});
    Object.assign(side, {width: (w - 3 * edge) * 0.58, height: tall});
    Object.assign(note, {width: (w - 3 * edge) * 0.42, height: tall});
    const scale = Math.max(...this.bass.strings.map(string => string.length)), many = this.bass.strings.length;
    const place = x => (neck.width / 2) * (0.015 + 0.97 * x / scale), lane = i => (neck.height / 2) * (many - 0.5 - i) / many;
    this.canvases = this.parts;
    this.drawNeck(colour, place, lane);
    this.drawSide(colour);
    this.drawNote(colour);
    this.canvases = of;
    g.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--ground");
    g.fillRect(0, 0, w, h);
    g.fillStyle = colour.ink;
    g.font = `${edge * 0.62}px system-ui, sans-serif`;
    g.textBaseline = "middle";
    g.fillText(title, edge, 1.25 * edge, w - 2 * edge);
    this.drawBoard(g, edge, 2 * edge, neck.width, tall, x => 2 * place(x), this.bass.strings[0]);
    g.drawImage(neck, edge, 2 * edge);
    for (const {part, x} of [{part: side, x: edge}, {part: note, x: 2 * edge + side.width}]) {
      g.fillStyle = colour.ground;
      g.fillRect(x, 3.2 * edge + tall, part.width, tall);
      g.drawImage(part, x, 3.2 * edge + tall);
    }
  }

  // Draws the board, with or without frets, and the pickups beyond it, as behind the page's strings.
  drawBoard(g, left, top, width, height, place, {frets, length}) {
    const end = place(frets.at(-1) + 0.008);
    g.fillStyle = "#5d1c0c";
    g.fillRect(left, top, width, height);
    g.fillStyle = "#432717";
    g.fillRect(left + place(0), top, end - place(0), height);
    g.fillStyle = this.bass.fretless ? "#cbb38b66" : "#b5b0a6";
    for (const fret of frets) g.fillRect(left + place(fret) - 2, top, 4, height);
    g.fillStyle = "#f7efdc";
    g.fillRect(left + place(0) - 4, top, 8, height);
    g.fillStyle = "#171412";
    for (const {position, aperture, strings} of this.bass.pickups) {
      const many = this.bass.strings.length, row = height / many, first = many - 1 - Math.max(...strings);
      const wide = Math.max(12, place(aperture) - place(0));
      g.fillRect(left + place(length - position) - wide / 2, top + row * first, wide, row * (Math.max(...strings) - Math.min(...strings) + 1));
    }
  }

  // px from one string to the next; with a single string, the whole `height`.
  gap(lane, height) {
    const many = this.bass.strings.length;
    return Math.abs(lane(0) - lane(many - 1)) / Math.max(1, many - 1) || height;
  }

  // The greatest zoom on the neck that keeps the slow motion within its lane.
  mostZoom() {
    if (!this.replay) return this.zoom;
    const {place, lane} = this, {rows, slots, length, string} = this.replay, scale = this.bass.strings[string].length;
    let most = 1e-6; // m
    for (let k = 0; k < length; k += SOME)
      if (slots[3 * k]) for (const u of this.shapeOf(rows.subarray(k * this.seen, (k + 1) * this.seen), this.seen, slots[3 * k], slots[3 * k + 1])) most = Math.max(most, Math.abs(u));
    return LANE_PART * this.gap(lane, this.canvases.neck.clientHeight) / (most * (place(scale) - place(0)) / scale);
  }

  // Draws strings and flashes over the page's board.
  drawNeck(colour, place, lane) {
    const [g, , h, dpr] = this.sheet(this.canvases.neck), {strings} = this.bass;
    const gap = this.gap(lane, h / dpr);
    for (const [key, {bright}] of this.flashes) {
      const [string, fret] = key.split(" ").map(Number), x = place(this.placeOf(string, fret));
      g.globalAlpha = 0.25 + 0.75 * bright;
      g.fillStyle = colour.flash;
      const tall = gap * (0.35 + 0.45 * bright), wide = 4 + 6 * bright;
      g.beginPath();
      g.ellipse(dpr * x, dpr * lane(string), dpr * wide, dpr * tall / 2, 0, 0, 2 * Math.PI);
      g.fill();
    }
    g.globalAlpha = 1;
    g.lineJoin = "round";
    const moving = new Map();
    if (!this.still.matches || this.replay) this.eachString(({string, length, u}) => {
      const scale = strings[string].length, path = new Path2D(), middle = lane(string);
      const metre = (place(scale) - place(0)) / scale, most = LANE_PART * gap; // px
      const enlarged = x => Math.max(-most, Math.min(most, x * metre * this.zoom));
      path.moveTo(dpr * place(0), dpr * middle);
      for (let k = 0; k <= POINTS; k++)
        path.lineTo(dpr * place(scale - length + length * k / POINTS), dpr * (middle - enlarged(u[k])));
      moving.set(string, [...(moving.get(string) || []), path]);
    });
    strings.forEach((string, i) => {
      const rest = new Path2D(), wide = dpr * Math.max(1.5, 1.8 * string.gauge);
      rest.moveTo(dpr * place(0), dpr * lane(i));
      rest.lineTo(dpr * place(string.length), dpr * lane(i));
      for (const path of moving.get(i) || [rest]) {
        g.lineWidth = wide + 2 * dpr;
        g.strokeStyle = colour.shade;
        g.stroke(path);
        g.lineWidth = wide;
        g.strokeStyle = colour.string;
        g.stroke(path);
      }
    });
  }

  // A contact's place, m from the nut: at a fret, or anywhere on a board.
  placeOf(string, fret) {
    const {frets} = this.bass.strings[string];
    return this.bass.fretless ? fret : frets[fret - 1];
  }

  // Draws the last string from the side over its crowns, with an axis in mm.
  drawSide(colour) {
    const [g, w, h, , px] = this.sheet(this.canvases.side), {string} = this.note, s = this.bass.strings[string];
    const below = Math.min(-1 * MM, ...s.heights) - 0.4 * MM, above = 4 * MM, left = 42 * px;
    const x = place => left + (w - left - 6 * px) * place / s.length, y = height => h * (above - height) / (above - below);
    g.font = `${11 * px}px system-ui, sans-serif`;
    g.textBaseline = "middle";
    for (let mm = Math.ceil(below / MM); mm <= above / MM - 0.5; mm++) {
      g.strokeStyle = mm ? colour.line : colour.edge;
      g.lineWidth = px;
      line(g, left, y(mm * MM), w, y(mm * MM));
      g.fillStyle = colour.soft;
      g.textAlign = "right";
      if (mm % 2 === 0) g.fillText(mm === 0 ? "0 mm" : mm, left - 4 * px, y(mm * MM));
    }
    if (this.bass.fretless) {
      g.strokeStyle = colour.soft;
      g.lineWidth = 2 * px;
      g.beginPath();
      s.frets.forEach((place, k) => g.lineTo(x(place), y(s.heights[k])));
      g.stroke();
    }
    s.frets.forEach((place, k) => {
      const flash = this.flashes.get(`${string} ${k + 1}`), wide = (flash ? 4 : 2) * px;
      if (this.bass.fretless) return;
      g.fillStyle = flash ? colour.accent : colour.soft;
      g.fillRect(x(place) - wide / 2, y(s.heights[k]), wide, h);
    });
    if (this.bass.fretless)
      for (const [key, {bright}] of this.flashes) {
        const [of, place] = key.split(" ").map(Number);
        if (of !== string) continue;
        g.globalAlpha = 0.3 + 0.7 * bright;
        g.fillStyle = colour.accent;
        g.fillRect(x(place) - 2 * px, y(below * 0.6), 4 * px, h);
        g.globalAlpha = 1;
      }
    g.strokeStyle = colour.ink;
    g.lineWidth = 1.75 * px;
    let drawn = false;
    if (!this.still.matches || this.replay) this.eachString(({string: i, fret, length, u}) => {
      if (i !== string || drawn) return;
      drawn = true;
      const stop = fret ? s.heights[fret - 1] : 0;
      g.beginPath();
      for (let k = 0; k <= POINTS; k++)
        g.lineTo(x(s.length - length + length * k / POINTS), y(u[k] + stop * (1 - k / POINTS)));
      g.stroke();
    });
    if (drawn) return;
    line(g, x(0), y(0), x(s.length), y(0));
  }

  // Draws the last note's hits from its release on: time to the right, frets upwards.
  drawNote(colour) {
    const [g, w, h, , px] = this.sheet(this.canvases.note), {string, frame, contacts} = this.note;
    const s = this.bass.strings[string], left = 30 * px, foot = 18 * px, count = s.frets.length;
    const far = this.bass.fretless ? s.length : count + 0.5;
    const x = ms => left + (w - left - 8 * px) * ms / NOTE_SPAN, y = fret => (h - foot) * (1 - fret / far);
    g.font = `${11 * px}px system-ui, sans-serif`;
    g.fillStyle = colour.soft;
    g.strokeStyle = colour.line;
    g.lineWidth = px;
    g.textBaseline = "middle";
    g.textAlign = "right";
    for (const fret of [5, 12, 17].filter(n => n <= count)) {
      const at = y(this.bass.fretless ? s.frets[fret - 1] : fret);
      line(g, left, at, w, at);
      g.fillText(this.bass.capo + fret, left - 5 * px, at);
    }
    g.textAlign = "center";
    for (let ms = 0; ms <= NOTE_SPAN; ms += 20) g.fillText(ms === NOTE_SPAN ? `${ms} ms` : ms, Math.min(x(ms), w - 16 * px), h - foot / 2);
    if (frame === undefined) return;
    if (this.replay) {
      const at = x(Math.max(0, Math.min(NOTE_SPAN, this.moment)));
      g.strokeStyle = colour.ink;
      line(g, at, 0, at, h - foot);
    }
    g.fillStyle = colour.accent;
    for (const {fret, frame: at, speed} of contacts) {
      const ms = 1000 * (at - frame) / this.rate, r = px * (1.2 + 3.8 * Math.min(1, Math.sqrt(speed / FULL_SPEED)));
      if (ms > NOTE_SPAN) continue;
      g.globalAlpha = 0.8;
      g.beginPath();
      g.arc(x(Math.max(0, ms)), y(fret), r, 0, 2 * Math.PI);
      g.fill();
    }
    g.globalAlpha = 1;
  }

  drawSpectrum(colour, analyser) {
    const [g, w, h, , px] = this.sheet(this.canvases.spectrum), foot = 18 * px;
    if (!this.bins.length) this.bins = new Float32Array(analyser.frequencyBinCount);
    analyser.getFloatFrequencyData(this.bins);
    const bin = this.rate / 2 / this.bins.length, ratio = HIGHEST_HZ / LOWEST_HZ;
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
    g.strokeStyle = colour.accent;
    g.lineWidth = 1.5 * px;
    g.beginPath();
    for (let x = 0; x < w; x += 2 * px) {
      const from = LOWEST_HZ * ratio ** (x / w) / bin, to = LOWEST_HZ * ratio ** ((x + 2 * px) / w) / bin;
      let most = -Infinity;
      for (let k = Math.floor(from); k <= Math.ceil(to); k++) most = Math.max(most, this.bins[k]);
      g.lineTo(x, (h - foot) * Math.min(1, Math.max(0, most / LEAST_DB)));
    }
    g.stroke();
  }
}
