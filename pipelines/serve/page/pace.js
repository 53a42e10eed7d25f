// How often and how finely the stage is drawn: less where frames are slow, more again where they are fast.
const LEVELS = [[1, 1], [0.75, 1], [0.6, 2], [0.5, 3]];  // share of the pixels along a side, frames from one shadow map to the next
const BEST = 0;  // level to begin with
const SLOW = 48, FAST = 26;  // milliseconds between frames from which less, and below which more, is drawn
const SPAN = 12;  // frames that are measured together
const PATIENCE = 4, MOST_PATIENCE = 64;  // fast spans before more is drawn; twice as many each time that this was too much
const LEAST = 30;  // least milliseconds between frames where the processor draws: it has other work, too
const RESTING = 200;  // the same while the server works for the stage
const MOST_RESTING = 3000;  // longest of such a while, milliseconds

export class Pace {
  constructor(stage) {
    this.stage = stage;
    this.until = 0;  // until then the server has the processor
    this.level = BEST;
    this.fast = 0;
    this.patience = PATIENCE;
    this.times = [];
    this.last = 0;
    this.count = 0;  // frames drawn
    this.raised = false;  // whether more is drawn than before
    this.apply();
  }

  apply() {
    const [share] = LEVELS[this.level];
    this.stage.renderer.setPixelRatio(share * (this.stage.weak ? 1 : Math.min(devicePixelRatio, 2)));
    this.stage.element.dataset.level = this.level;
  }

  /** Draw less while the server works for the stage, for a while. */
  rest(on) { this.until = on ? performance.now() + MOST_RESTING : 0; }

  /** Whether a frame is to be drawn now. */
  due(now) {
    const passed = now - this.last, resting = now < this.until;
    if (this.stage.weak && passed < (resting ? RESTING : LEAST)) return false;
    this.last = now;
    this.count += 1;
    this.stage.renderer.shadowMap.autoUpdate = false;
    this.stage.renderer.shadowMap.needsUpdate = this.count % LEVELS[this.level][1] === 0;
    if (!resting && passed < 1000) this.measure(passed);
    return true;
  }

  measure(passed) {
    this.times.push(passed);
    if (this.times.length < SPAN) return;
    const middle = this.times.sort((a, b) => a - b)[SPAN >> 1];
    this.times = [];
    if (middle > SLOW && this.level < LEVELS.length - 1) {
      if (this.raised) this.patience = Math.min(2 * this.patience, MOST_PATIENCE);
      this.raised = false;
      this.go(1);
    } else if (middle > FAST + (this.stage.weak ? LEAST - 16 : 0)) this.fast = 0;
    else if (++this.fast >= this.patience && this.level > BEST) { this.raised = true; this.go(-1); }
  }

  go(step) {
    this.level += step;
    this.fast = 0;
    this.apply();
  }
}
