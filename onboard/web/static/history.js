// What the page remembers of each accelerometer, bounded: a page open for a day does not grow.

const POINTS_MAX = 600;

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
 * Histories by accelerometer; each row is trusted seconds, then six values, six sigmas, six in force.
 * They go by trusted time: a vehicle that stands for days adds nothing.
 */
export class Remembered {
  constructor() {
    this.byImu = new Map();
    this.trusted = new Map();
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
      for (const [, trusted, value, sigma, inForce] of rows) history.add([trusted, ...value, ...sigma, ...inForce]);
    }
  }

  /** Take a snapshot in; what was learned being forgotten begins the history anew. */
  take(snapshot) {
    for (const view of snapshot.imus) {
      const history = this.of(view.imu);
      if (view.trusted_s + 1 < (this.trusted.get(view.imu) ?? 0)) history.clear();
      this.trusted.set(view.imu, view.trusted_s);
      if (view.trusted_s <= 0) continue;
      const c = view.calibration;
      history.add([
        view.trusted_s,
        ...c.scale, ...c.offset,
        ...c.scale_sigma, ...c.offset_sigma,
        ...view.in_force_scale, ...view.in_force_offset,
      ]);
    }
  }
}
