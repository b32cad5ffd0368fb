// Hands objects that were tracked in the page over to the service, as sessions that other clients can go on with.

import { catchUp } from "./again.js";
import { scaled } from "./boxes.js";
import { refusedState } from "./objects.js";

/**
 * @typedef {object} Handed
 * @property {string} name The object's.
 * @property {string} id The session's.
 * @property {boolean} isWhole Whether the session has the tracker's state; else it begins with the last frame and box.
 */

/**
 * @param {Run} run
 * @param {Client} client
 * @returns {Promise<Handed[]>}
 */
export async function handOver(run, client) {
  const handed = [];
  for (const object of run.objects) {
    const whole = await restored(run, object, client);
    const session = whole ?? (await openedAnew(run, object, client));
    if (session) handed.push({ name: object.name, id: session.id, isWhole: whole !== undefined });
  }
  return handed;
}

/** A session with the tracker's state; undefined where there is no state, or the service refuses it.
 * @param {Run} run
 * @param {FollowedObject} object
 * @param {Client} client */
async function restored(run, object, client) {
  const save = async () => object.follower.save();
  // After a reload, the page has no session yet, but a saved state of some frames before: catch up from there.
  const opened = async () => object.saves[0] && !run.source.isAbsent && run.alone(() => catchUp(run, object));
  const state = await save()
    .catch(() => opened().then(save))
    .catch(() => undefined);
  return state && client.restore(state).catch(refusedState);
}

/**
 * @param {Run} run
 * @param {FollowedObject} object
 * @param {Client} client */
async function openedAnew(run, object, client) {
  const row = [...object.rows.values()].pop();
  const picture = row && (await run.frames.at(row.frame));
  return picture && client.open(picture.blob, scaled(row.box, picture.image, run.source.size));
}
