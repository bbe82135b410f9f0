// Where the page's data comes from. All sources return bytes by name; those that ask a server are in served.js.
/** @import { Source } from './types' */

/** Source named in the document -> makes it. @type {Record<string, () => Source>} */
export const SOURCES = { embedded: () => new EmbeddedSource() };

/** Data in the page itself: base64 of zlib streams. */
class EmbeddedSource {
  isLive = false;

  /** @param {string} name */
  async blob(name) {
    const raw = atob(document.getElementById(`data-${name}`).textContent);
    const stream = new Blob([Uint8Array.from(raw, (c) => c.charCodeAt(0))]).stream().pipeThrough(new DecompressionStream('deflate'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }
}
