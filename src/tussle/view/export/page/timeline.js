// The clock: what time it is, how fast it goes, and the slider that shows it.

const SPEEDS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];

class Clock {
  constructor(layer) {
    this.layer = layer;
    this.t = layer.start;
    this.isPlaying = false;
    this.speed = 1;
    this.isLooping = false;
    this.slider = document.getElementById('time');
    this.slider.min = String(layer.start);
    this.slider.max = String(layer.end);
    const { times } = layer;
    this.decimals = times.length > 1 ? decimalsOf((layer.end - layer.start) / (times.length - 1)) : 1;
    this.parts = document.querySelectorAll('#clock b, #clock span');
    say(this.parts[1], `/ ${layer.end.toFixed(this.decimals)} s`);
  }

  get frame() {
    return this.layer.frameAt(this.t);
  }

  /** Move on by seconds of the watcher's time. */
  advance(seconds) {
    const { layer } = this;
    this.t += seconds * this.speed;
    if (this.t < layer.end) return;
    this.t = this.isLooping ? layer.start : layer.end;
    this.isPlaying = this.isLooping;
  }

  play() {
    if (this.t >= this.layer.end) this.t = this.layer.start;
    this.isPlaying = this.layer.end > this.layer.start;
  }

  seek(t) {
    this.t = between(t, this.layer.start, this.layer.end);
  }

  /** To the beginning of a frame some frames away; between two frames, one back is the beginning of the present one. */
  stepFrames(n) {
    const { times } = this.layer;
    const { frame } = this;
    const isBetween = n < 0 && this.t > times[frame] + this.layer.slack;
    this.isPlaying = false;
    this.t = times[between(frame + n + (isBetween ? 1 : 0), 0, times.length - 1)];
  }

  /** The next speed in the list. */
  change(n) {
    const i = SPEEDS.indexOf(this.speed);
    this.speed = SPEEDS[between(i + n, 0, SPEEDS.length - 1)];
  }

  show() {
    const { layer, t } = this;
    say(this.parts[0], t.toFixed(this.decimals));
    if (document.activeElement !== this.slider || this.isPlaying) this.slider.value = String(t);
    const share = layer.end > layer.start ? (t - layer.start) / (layer.end - layer.start) : 0;
    this.slider.style.setProperty('--done', `${100 * share}%`);
    this.slider.setAttribute('aria-valuetext', `${t.toFixed(this.decimals)} seconds`);
    const play = document.getElementById('play');
    play.classList.toggle('is-playing', this.isPlaying);
    play.setAttribute('aria-label', this.isPlaying ? 'Pause' : 'Play');
    say(document.getElementById('speed'), times(this.speed));
  }
}
