// Opens the page to tests and measuring tools: an event "livebass" carries a function as its detail, which is called
// with the modules' exports.
import * as bass from "./bass.js";
import * as benchview from "./benchview.js";
import * as cases from "./cases.js";
import * as controls from "./controls.js";
import * as files from "./files.js";
import * as hands from "./hands.js";
import * as meters from "./meters.js";
import * as neck from "./neck.js";
import * as opening from "./opening.js";
import * as page from "./page.js";
import * as player from "./player.js";
import * as replay from "./replay.js";
import * as riff from "./riff.js";
import * as share from "./share.js";
import * as songs from "./songs.js";
import * as sounds from "./sounds.js";
import * as state from "./state.js";
import * as story from "./story.js";
import * as techniques from "./techniques.js";
import * as transport from "./transport.js";
import * as view from "./view.js";
import * as workshop from "./workshop.js";

const inside = {
  ...bass, ...benchview, ...cases, ...controls, ...files, ...hands, ...meters, ...neck, ...opening, ...page,
  ...player, ...replay, ...riff, ...share, ...songs, ...sounds, ...story, ...state,
  ...techniques, ...transport, ...view, ...workshop,
};
addEventListener("livebass", e => /** @type {CustomEvent<(all: typeof inside) => void>} */ (e).detail(inside));
