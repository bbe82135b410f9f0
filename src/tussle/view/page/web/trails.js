// Trails: where entities have come from.
/** @import { Vector } from './types' */

import { between } from './geometry.js';
import { Layer } from './layer.js';
import { Lines } from './lines.js';
import { PlainRenderer } from './plain.js';
import { Renderer } from './renderer.js';

/** Points of all trails together; with more, each has fewer. */
const MAX_POINTS = 120000;
/** Length of the chosen entity's trail where the others have none [s]. */
export const TRAIL_OF_CHOSEN = 10;
/** Lengths of trails that can be chosen [s]. */
export const TRAIL_LENGTHS = [0, 1, 2, 5, 10, 30, 120, Infinity];

export class Trails extends Lines {
  /** @param {Renderer | PlainRenderer} renderer @param {Layer} layer */
  constructor(renderer, layer) {
    super(renderer);
    this.layer = layer;
  }

  /** Lay out the trails of the last seconds; `chosen` has one in any case. @param {Vector} anchor @param {number} seconds @param {Set<number>} hidden teams @param {number} chosen */
  place(anchor, seconds, hidden, chosen) {
    const { layer } = this;
    const span = seconds || TRAIL_OF_CHOSEN;
    const n = seconds ? layer.shown.n : 1;
    this.begin(anchor);
    if (seconds || chosen) {
      layer.trails(span, Math.max(4, Math.floor(MAX_POINTS / Math.max(1, n))), seconds ? null : [chosen], (id, places, times) => {
        const slot = layer.slotOf(id);
        const team = slot >= 0 ? layer.shown.team[slot] : layer.teamOf(id).id;
        if (hidden.has(team)) return;
        const colour = slot >= 0 ? layer.colourOf(slot) : layer.colour(layer.blockOf.get(id), team);
        places.forEach((place, i) => {
          const age = span === Infinity ? 0.35 : between((layer.shown.t - times[i]) / span, 0, 1);
          this.add(place, age, colour, i + 1 < places.length);
        });
      });
    }
    this.upload();
  }
}
