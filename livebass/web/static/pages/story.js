// The stories: each step sets a bass and its bench, plays a note, shows it slowly and says what it shows.
import {chooseBench} from "../bench/benchview.js";
import {doneBy, tell} from "../neck/line.js";
import {$, PAGE, bassCalled, say} from "./page.js";
import {player} from "../audio/player.js";
import {backToNow, move, showSlowly} from "../neck/replay.js";
import {hear, hush} from "../audio/sounds.js";
import {see} from "../neck/view.js";

/** @type {{story?: Story, at: number, own: boolean}} */
export const telling = {at: 0, own: false}; // own: somebody played a note of their own since the step began

// Shows a step of a story; silent until somebody asked for sound.
export async function showStep(/** @type {Story} */ story, /** @type {number} */ at) {
  const {bass, values, notes, says} = story.steps[at];
  Object.assign(telling, {story, at, own: false});
  showBar();
  chooseBench(bass, values);
  history.replaceState(null, "", `#story=${story.name}&step=${at + 1}`);
  tell(says.replace(/: \{hits\}.*/, " …"));
  const file = await player.fileOf(bass), made = [];
  for (const [string, fret, velocity] of notes)
    made.push(await move({performed: {string, note: bassCalled(bass).strings[string].note + fret, velocity}}, file));
  if (telling.story !== story || telling.at !== at || telling.own) return; // somebody went on, or plays
  if (!made.length) {
    if (see.replay) backToNow();
    return;
  }
  const replay = showSlowly(made[0]), none = !replay.hits.length && !see.liesOn(replay);
  tell(says.replace("{hits}", none ? "it touches nothing" : doneBy(replay)));
  if (player.sounding) hear(made.map(({sound}) => sound));
}

function showBar() {
  const {story, at, own} = telling;
  document.body.classList.toggle("in-story", Boolean(story) && !own);
  $("story").hidden = !story;
  if (!story) return;
  $("story-at").textContent = `${at + 1} / ${story.steps.length}`;
  $("story-back").disabled = at === 0;
  $("story-next").textContent = at + 1 < story.steps.length ? "Next" : "End";
}

const failed = (/** @type {Error} */ error) => say(`The story cannot go on: ${error.message}`);

// Goes to a step, with sound; after the last one the story ends.
async function go(/** @type {Story} */ story, /** @type {number} */ at) {
  await player.sound();
  if (at < story.steps.length) return showStep(story, at);
  telling.story = undefined;
  showBar();
  hush();
  if (see.replay) backToNow();
  history.replaceState(null, "", location.href.split("#")[0]);
}

// Shows the step that the page's address names, and returns whether there is one.
export function showLinkedStory() {
  const requested = new URLSearchParams(location.hash.slice(1)), name = requested.get("story"), step = requested.get("step") || "1";
  if (name === null) return false;
  const story = PAGE.stories.find(story => story.name === name), at = Number(step) - 1;
  if (story?.steps[at]) showStep(story, at).catch(failed);
  else {
    showBar();
    say(`The link names no step of a story on this page: ${name.slice(0, 20)}, ${step.slice(0, 20)}.`);
  }
  return true;
}

for (const story of PAGE.stories || [])
  $(/** @type {"stories"} */ (`story-${story.name}`)).onclick = () => { go(story, 0).catch(failed); };
$("story-back").onclick = () => { if (telling.story) go(telling.story, telling.at - 1).catch(failed); };
$("story-next").onclick = () => { if (telling.story) go(telling.story, telling.at + 1).catch(failed); };
player.on("struck", () => {
  telling.own = true;
  showBar();
});
addEventListener("hashchange", () => { if (player.ready) showLinkedStory(); });
