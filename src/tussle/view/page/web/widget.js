// The widget of a notebook: the page in a frame, and messages between the page and the kernel.

/** Time without an answer of the kernel after which the reader is told [ms]. */
const PATIENCE = 8000;

/** @param {{ model: any, el: HTMLElement }} cell @returns {() => void} */
function render({ model, el }) {
  // All cells that show the widget get all messages of the kernel; each takes its own.
  const view = `${Date.now()}-${Math.random()}`;
  const frame = document.createElement('iframe');
  // The page runs its own script and nothing else, and reaches nothing of the notebook.
  frame.setAttribute('sandbox', 'allow-scripts');
  frame.title = 'tussle';
  frame.style.cssText = `width: 100%; height: ${model.get('height')}px; border: 0; display: block`;
  const gone = document.createElement('p');
  gone.className = 'tussle-gone';
  gone.hidden = true;
  gone.textContent = 'The kernel does not answer: it is busy, or it has ended. This view needs it; when it runs again, run the cell again.';
  el.append(gone, frame);
  let asked = 0;
  const hear = (/** @type {MessageEvent} */ event) => {
    if (event.source !== frame.contentWindow) return;
    asked ||= performance.now();
    model.send({ ...event.data, view });
  };
  const take = (/** @type {any} */ content, /** @type {DataView[]} */ buffers = []) => {
    if (content.view !== view) return;
    asked = 0;
    const [data] = buffers;
    const bytes = data ? new Uint8Array(data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength)) : null;
    frame.contentWindow?.postMessage({ content, bytes }, '*');
  };
  const watch = setInterval(() => { gone.hidden = !asked || performance.now() - asked < PATIENCE; }, 500);
  window.addEventListener('message', hear);
  model.on('msg:custom', take);
  frame.srcdoc = model.get('html');
  return () => {
    clearInterval(watch);
    window.removeEventListener('message', hear);
    model.off('msg:custom', take);
    model.send({ do: 'leave', view });
  };
}

export default { render };
