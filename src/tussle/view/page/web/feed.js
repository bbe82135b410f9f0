// The panel of messages: what plugins publish, by topic.
/** @import { Player } from './player.js' */

import { byId, element, field, number, say } from './formatting.js';
import { Live } from './live.js';

export class MessagePanel {
  /** @param {Player} player */
  constructor(player) {
    this.player = player;
    this.box = byId('feed');
    this.filter = field('topics');
    this.filter.addEventListener('input', () => player.look());
  }

  toggle() {
    const { player, box } = this;
    if (!player.source.isLive) return;
    box.hidden = !box.hidden;
    byId('quantities').hidden ||= !box.hidden;
    player.order('listen', { is_on: !box.hidden });
    player.look();
  }

  show() {
    const { layer } = this.player;
    if (this.box.hidden || !(layer instanceof Live)) return;
    const wanted = this.filter.value.toLowerCase();
    const rows = (layer.status.feed || []).filter(([topic]) => topic.toLowerCase().includes(wanted));
    const list = this.box.querySelector('ul');
    if (list.children.length !== rows.length) list.replaceChildren(...rows.map(() => element('li', '', '', element('b'), element('span'), element('p'))));
    rows.forEach(([topic, rate, last], i) => {
      const [name, count, text] = list.children[i].children;
      say(name, topic);
      say(count, `${number(rate)}/s`);
      say(text, last);
    });
    byId('silence').hidden = rows.length > 0;
  }
}
