// The pitch of a sound: where its fundamental is, and how fast the fundamental's own phase turns. A string's overtones
// are sharp, so the period of the whole sound would be, too.
const COARSE_RATE = 12000; // Hz, enough to find the fundamental
const LOWEST = 28, HIGHEST = 420; // Hz
const QUIETEST = 1e-7; // mean square
const CLEAREST = 0.6, AS_CLEAR = 0.92; // likeness of a period to the next one: at least, and beside the clearest
const PERIODS = 5; // of the fundamental in a window: its overtones are then outside the window's main lobe

// The fundamental (Hz) in the last samples, by McLeod's normalised square difference; undefined: none.
function roughly(sound, rate) {
  const every = Math.max(1, Math.round(rate / COARSE_RATE)), n = Math.floor(sound.length / every);
  const x = new Float32Array(n);
  for (let k = 0; k < n; k++) {
    let sum = 0;
    for (let j = 0; j < every; j++) sum += sound[k * every + j];
    x[k] = sum / every;
  }
  let energy = 0;
  for (const value of x) energy += value * value;
  if (energy / n < QUIETEST) return undefined;
  const minimum = Math.floor(rate / every / HIGHEST), maximum = Math.ceil(rate / every / LOWEST);
  const like = new Float32Array(maximum + 2), room = n - maximum - 2;
  for (let lag = minimum - 1; lag < like.length; lag++) {
    let product = 0, square = 0;
    for (let k = 0; k < room; k++) {
      product += x[k] * x[k + lag];
      square += x[k] * x[k] + x[k + lag] * x[k + lag];
    }
    like[lag] = 2 * product / (square || 1);
  }
  const highest = like.reduce((a, b) => Math.max(a, b));
  if (highest < CLEAREST) return undefined;
  for (let lag = minimum; lag <= maximum; lag++) {
    const [a, b, c] = [like[lag - 1], like[lag], like[lag + 1]];
    if (b < AS_CLEAR * highest || b < a || b < c) continue;
    return rate / every / (lag + (a - c) / (2 * (a - 2 * b + c) || 1));
  }
  return undefined;
}

// The phase (rad) of `hertz` in the `length` samples from `first` on, under a Hann window.
function phaseAt(sound, first, length, hertz, rate) {
  const turn = 2 * Math.PI * hertz / rate;
  let real = 0, imaginary = 0;
  for (let k = 0; k < length; k++) {
    const x = sound[first + k] * (1 - Math.cos(2 * Math.PI * k / length));
    real += x * Math.cos(turn * k);
    imaginary -= x * Math.sin(turn * k);
  }
  return Math.atan2(imaginary, real);
}

// A sound's fundamental (Hz); undefined: none.
export function pitchOf(sound, rate) {
  const rough = roughly(sound, rate);
  if (!rough) return undefined;
  const length = Math.round(Math.min(0.8 * sound.length, Math.max(sound.length / 2, PERIODS * rate / rough)));
  const lag = sound.length - length;
  const [before, after] = [0, lag].map(first => phaseAt(sound, first, length, rough, rate));
  const turned = (after - before) / (2 * Math.PI) - rough * lag / rate;
  return rough + (turned - Math.round(turned)) * rate / lag;
}
