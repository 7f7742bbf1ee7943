// Opens the page to tests and measuring tools: an event "livebass" carries a function as its detail, which is called
// with the modules' exports.
import * as bass from "../bench/bass.js";
import * as benchview from "../bench/benchview.js";
import * as cases from "./cases.js";
import * as controls from "../bench/controls.js";
import * as files from "./files.js";
import * as hands from "../neck/hands.js";
import * as meters from "../audio/meters.js";
import * as neck from "../neck/neck.js";
import * as opening from "./opening.js";
import * as page from "./page.js";
import * as player from "../audio/player.js";
import * as pull from "../neck/pull.js";
import * as replay from "../neck/replay.js";
import * as riff from "../score/riff.js";
import * as share from "./share.js";
import * as songs from "../score/songs.js";
import * as sounds from "../audio/sounds.js";
import * as state from "./state.js";
import * as story from "./story.js";
import * as techniques from "../neck/techniques.js";
import * as transport from "../score/transport.js";
import * as view from "../neck/view.js";
import * as workshop from "../audio/workshop.js";

const inside = {
  ...bass, ...benchview, ...cases, ...controls, ...files, ...hands, ...meters, ...neck, ...opening, ...page,
  ...player, ...pull, ...replay, ...riff, ...share, ...songs, ...sounds, ...story, ...state,
  ...techniques, ...transport, ...view, ...workshop,
};
addEventListener("livebass", e => /** @type {CustomEvent<(all: typeof inside) => void>} */ (e).detail(inside));
