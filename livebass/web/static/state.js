// What changes while the page is open. Player, bench and pictures keep their own.

/** @type {PageState} */
export const state = {
  octave: 28, // the lowest note of the piano
  from: 0, // frets of the neck that lie left of its part that is shown
  width: 0, // px of the neck when it was drawn
  stroke: undefined, // what the player plucks with; undefined: a stroke of the bass that has no button
  toldStroke: undefined, // the stroke that the bass knows of
  loud: -60, // dB that the meter shows
  late: 0, // load that the meter shows
  watched: 0, // frame until which the page knows what the bass does that plays elsewhere
  rolling: false, // slow motion goes on
  usualZoom: 20, // before the slow motion
  lastLook: 0, // ms, at a picture of the slow motion
  early: [], // keys that were pressed since the sound was asked for, until it runs
  song: undefined,
  rolls: undefined, // the song that plays: {from, messages, sent, timer}
  tape: undefined, // blocks of a recording
  responseFile: undefined, // the player's own impulse response, as it was read
};
