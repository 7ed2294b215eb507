// What the page remembers of each accelerometer, bounded: a page open for a day does not grow.

const POINTS_MAX = 600;
const BACK_S = 1; // trusted time that went back by more: the estimates have begun anew

/**
 * Rows of (time, values...) in a fixed budget.  When it is full every second row is dropped and
 * from then on rows are taken half as often, so that the whole time since the start stays
 * visible, only coarser.
 */
export class History {
  constructor(limit = POINTS_MAX) {
    this.limit = limit;
    this.clear();
  }

  clear() {
    this.over = false;
    this.rows = [];
    this.every = 1;
    this.skipped = 0;
    this.provisional = false;
  }

  /** Add a row; one of the same time takes the place of the last. */
  add(row) {
    const last = this.rows.at(-1);
    if (last && row[0] <= last[0]) {
      if (row[0] === last[0]) this.rows[this.rows.length - 1] = row;
      return;
    }
    if (this.provisional) this.rows.pop(); // the newest is always shown, even if not kept
    this.rows.push(row);
    this.skipped += 1;
    this.provisional = this.skipped < this.every && this.rows.length > 1;
    if (this.provisional) return;
    this.skipped = 0;
    if (this.rows.length >= this.limit) {
      this.rows = this.rows.filter((_, index) => index % 2 === 0);
      this.every *= 2;
      if (this.rows.at(-1) !== row) {
        this.rows.push(row);
        this.provisional = true;
        this.skipped = this.every / 2;
      }
    }
  }

  get length() {
    return this.rows.length;
  }

  /** From the first row to the last. */
  get seconds() {
    return this.rows.length ? this.rows.at(-1)[0] - this.rows[0][0] : 0;
  }

  /** One column of all rows. */
  column(index) {
    return this.rows.map((row) => row[index]);
  }
}

/**
 * Histories by accelerometer; each row is seconds of trusted flight, then six values, six sigmas, six
 * in force.  As the service's own (onboard/daemon/history.py), which they begin with: time on
 * the ground adds nothing, and a curve ends when the flight that replaces it begins.
 */
export class Remembered {
  constructor() {
    this.byImu = new Map();
    this.trusted = new Map();
    this.resets = null;
  }

  of(imu) {
    if (!this.byImu.has(imu)) this.byImu.set(imu, new History());
    return this.byImu.get(imu);
  }

  /** Begin with what the service remembers (GET /api/history). */
  load({ imus }) {
    for (const { imu, rows } of imus) {
      const history = this.of(imu);
      history.clear();
      for (const [, flown, value, sigma, inForce] of rows) history.add([flown, ...value, ...sigma, ...inForce]);
    }
  }

  /** Take a snapshot in. */
  take(snapshot) {
    const resets = snapshot.counters?.resets ?? 0;
    if (this.resets !== null && resets !== this.resets) this.byImu.clear();
    this.resets = resets;
    const flying = snapshot.link.armed !== false && snapshot.link.landed !== true;
    for (const view of snapshot.imus) {
      const history = this.of(view.imu);
      const flown = this.advance(history, view, flying);
      if (flown === null) continue;
      const c = view.calibration;
      history.add([
        flown,
        ...c.scale, ...c.offset,
        ...c.scale_sigma, ...c.offset_sigma,
        ...view.in_force_scale, ...view.in_force_offset,
      ]);
    }
  }

  /** Where on the axis of trusted flight this moment lies; null: before any flight. */
  advance(history, view, flying) {
    let gained = view.trusted_s - (this.trusted.get(view.imu) ?? view.trusted_s);
    this.trusted.set(view.imu, view.trusted_s);
    if (gained < -BACK_S) {
      history.over = true;
      gained = view.trusted_s;
    }
    const last = history.rows.at(-1)?.[0];
    if (!(flying && gained > 0)) return last === undefined || history.over ? null : last;
    if (history.over) history.clear();
    return (history.rows.at(-1)?.[0] ?? 0) + gained;
  }
}
