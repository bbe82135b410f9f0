// Data from the page that has this one in a frame: a notebook, whose kernel may be on a machine that no port of this one reaches.
/** @import { MessageHandlers } from './types' */

import { readMessage } from './packing.js';
import { SOURCES } from './sources.js';

/** Data by name. The widget passes requests to the kernel, and answers to this page. */
class FrameSource {
  isLive = false;

  constructor() {
    /** @type {Map<string, { done: (bytes: Uint8Array<ArrayBuffer>) => void, failed: (error: Error) => void }>} */
    this.awaited = new Map();
    window.addEventListener('message', (event) => {
      if (event.source === window.parent) this.take(event.data.content, event.data.bytes);
    });
  }

  /** @param {{ do: string, name?: string, error?: string, text?: string }} content @param {Uint8Array<ArrayBuffer> | null} bytes */
  take(content, bytes) {
    if (content.do !== 'blob') return;
    const request = this.awaited.get(content.name);
    this.awaited.delete(content.name);
    if (content.error) request?.failed(new Error(content.error));
    else request?.done(bytes);
  }

  /** @param {string} name @returns {Promise<Uint8Array<ArrayBuffer>>} */
  blob(name) {
    return new Promise((done, failed) => {
      this.awaited.set(name, { done, failed });
      window.parent.postMessage({ do: 'blob', name }, '*');
    });
  }
}

/** A live game. */
class LiveFrameSource extends FrameSource {
  isLive = true;

  /** @param {MessageHandlers} hear called with header and data of each message */
  connect(hear) {
    this.hear = hear;
    window.parent.postMessage({ do: 'watch' }, '*');
  }

  /** @param {{ do: string, name?: string, error?: string, text?: string }} content @param {Uint8Array<ArrayBuffer> | null} bytes */
  take(content, bytes) {
    super.take(content, bytes);
    if (content.do === 'lost') this.hear?.lost();
    if (content.do !== 'game') return;
    if (bytes) {
      const [header, data] = readMessage(bytes);
      this.hear[/** @type {'frame' | 'past' | 'drawn'} */ (header.kind)](header, data);
      // The next message comes when this one has been taken: a slow browser misses frames, and nothing piles up.
    } else {
      const message = JSON.parse(content.text);
      this.hear[/** @type {'status' | 'curves'} */ (message.kind)](message);
    }
    window.parent.postMessage({ do: 'taken' }, '*');
  }

  /** Send a command. @param {string} command */
  send(command, fields = {}) {
    window.parent.postMessage({ do: 'command', text: JSON.stringify({ do: command, ...fields }) }, '*');
  }
}

SOURCES.framed = () => new FrameSource();
SOURCES.framedLive = () => new LiveFrameSource();
