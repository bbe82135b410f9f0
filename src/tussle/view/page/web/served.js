// Data from the page's own server: by requests for ranges of frames, or by a socket while a game is played.
/** @import { MessageHandlers } from './types' */

import { readMessage } from './packing.js';
import { SOURCES } from './sources.js';

const ADDRESS = location.origin + location.pathname.replace(/\/$/, '');

/** A recorded run, of which the page asks for what it shows. */
class RangeSource {
  isLive = false;

  /** @param {string} name */
  async blob(name) {
    const answer = await fetch(`${ADDRESS}/${name}`);
    if (!answer.ok) throw new Error((await answer.text()).trim());
    return new Uint8Array(await answer.arrayBuffer());
  }
}

/** A live game. */
class SocketSource extends RangeSource {
  isLive = true;

  /** @param {MessageHandlers} hear called with header and data of each message */
  connect(hear) {
    this.socket = new WebSocket(ADDRESS.replace('http', 'ws'));
    this.socket.binaryType = 'arraybuffer';
    this.socket.addEventListener('message', ({ data }) => {
      if (typeof data === 'string') {
        const message = JSON.parse(data);
        return hear[/** @type {'status' | 'curves'} */ (message.kind)](message);
      }
      const [header, bytes] = readMessage(new Uint8Array(data));
      return hear[/** @type {'frame' | 'past' | 'drawn'} */ (header.kind)](header, bytes);
    });
    this.socket.addEventListener('close', () => hear.lost());
  }

  /** Send a command, if the socket is open. @param {string} command */
  send(command, fields = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ do: command, ...fields }));
  }
}

SOURCES.range = () => new RangeSource();
SOURCES.socket = () => new SocketSource();
