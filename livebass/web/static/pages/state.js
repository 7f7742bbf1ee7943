// The page's state. Player, bench and pictures keep their own.

/** @type {PageState} */
export const state = {
  octave: 28, // the lowest note of the piano
  from: 0, // frets to the left of the neck's visible part
  width: 0, // px of the neck when it was drawn
  stroke: undefined, // the player's stroke; undefined: a stroke of the bass without a button
  sentStroke: undefined, // the stroke that the bass knows
  loud: -60, // dB that the meter shows
  late: 0, // load that the meter shows
  watched: 0, // last known frame of a bass that plays elsewhere
  rolling: false, // slow motion goes on ...
  repeats: false, // ... and begins again at its end
  lastLook: 0, // ms, at a picture of the slow motion
  lastSaid: 0, // ms, when its moment was said
  early: [], // keys pressed after the sound was requested, until it runs
  song: undefined,
  rolls: undefined, // a song that plays: {begun}
  tape: undefined, // blocks of a recording
  responseFile: undefined, // the player's own impulse response, as read
};
