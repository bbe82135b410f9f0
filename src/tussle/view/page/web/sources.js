// Where the page's data comes from. All sources give bytes by name; those of a server stand in served.js.

/** Source named in the document -> makes it. */
export const SOURCES = { embedded: () => new EmbeddedSource() };

/** Data that stands on the page itself. */
class EmbeddedSource {
  /** Bytes by name: base64 of a zlib stream. */
  async blob(name) {
    const raw = atob(document.getElementById(`data-${name}`).textContent);
    const bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }
}
