// Handing over to the service what was tracked in the page, so that others can go on with it.

import { catchUp } from "./again.js";
import { scaled } from "./boxes.js";
import { refusedState } from "./objects.js";

/**
 * @typedef {object} Handed
 * @property {string} name Of the object.
 * @property {string} id Of its session.
 * @property {boolean} isWhole Whether the session has all that the tracker has learned; else the last frame and its box.
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

/** A session with the tracker's state; nothing where the service does not take it, or where there is none.
 * @param {Run} run
 * @param {FollowedObject} object
 * @param {Client} client */
async function restored(run, object, client) {
  const save = async () => object.follower.save();
  // Loaded anew, the page has no session yet, but its state of some frames before.
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
