// Names of the snapshot in words, numbers in the digits that their sigma supports.

// Effects and reasons are the service's own words; without them their names are read as words.
const { effects: EFFECTS, reasons: REASONS } = await fetch("words.json")
  .then((answer) => answer.json())
  .catch(() => ({ effects: {}, reasons: {} }));
const TONES = { good: "good", info: "", warning: "warn", error: "bad" };
const POLICIES = {
  never: "nothing is ever written",
  landed: "written when landed and disarmed",
  in_flight: "written in flight in bounded steps",
};

const FIRMWARE = { ardupilot: "ArduPilot", px4: "PX4" };

const plain = (name) => String(name).replaceAll("_", " ");
const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

/** Who is behind the link, in a few words. */
export const vehicleInWords = ({ autopilot, vehicle, system_id: system }) =>
  `${FIRMWARE[autopilot] ?? autopilot ?? "autopilot"} ${vehicle ?? ""}, system ${system}`;

export const reasonInWords = (name) => REASONS[name] ?? plain(name);
/** How a severity looks. */
export const toneOf = (severity) => TONES[severity] ?? "warn";
export const effectInWords = (name) => EFFECTS[name] ?? capital(plain(name));
/** A unit with raised digits; nothing for a plain number. */
export const unitInWords = (unit) => (unit === "1" || unit === "-" ? "" : unit.replaceAll("^2", "²").replaceAll("^3", "³"));
export const policyInWords = (name) => POLICIES[name] ?? plain(name);
export { plain, capital };

/** A number with as many decimals as `sigma` has two digits of; "–" where there is none. */
export function measured(value, sigma, unit = "") {
  if (value === null || value === undefined) return "–";
  const digits = sigma > 0 ? Math.min(6, Math.max(0, 1 - Math.floor(Math.log10(sigma)))) : 4;
  return signed(value.toFixed(digits)) + unit;
}

/** `digits` significant digits, a true minus sign. */
export function brief(value, digits = 3) {
  if (value === null || value === undefined) return "–";
  if (value === 0) return "0";
  const decimals = Math.min(6, Math.max(0, digits - 1 - Math.floor(Math.log10(Math.abs(value)))));
  return signed(value.toFixed(decimals));
}

export const fixed = (value, decimals) =>
  value === null || value === undefined ? "–" : signed(value.toFixed(decimals));

const signed = (text) => (Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−"));

/** A duration in seconds as people say it. */
export function duration(seconds) {
  const whole = Math.round(seconds);
  if (whole < 100) return `${whole} s`;
  if (whole < 6000) return `${Math.floor(whole / 60)} min ${whole % 60} s`;
  const minutes = Math.round(whole / 60);
  return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

/** What is dated before that was dated by a clock that nobody had set (as in snapshot.py). */
const DATED_FROM = 1600000000;

/** Unix time as the clock of whoever reads. */
export function clockTime(unix) {
  if (unix < DATED_FROM) return "--:--:--";
  return new Date(unix * 1000).toLocaleTimeString([], { hour12: false });
}

/** Unix time as day and clock of whoever reads. */
export function moment(unix) {
  if (unix < DATED_FROM) return "date not known";
  return new Date(unix * 1000).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
}

const AXES = ["X", "Y", "Z"];

/** ArduPilot's name of number `index` (x, y, z scale, x, y, z offset) of accelerometer `imu`. */
export function parameterName(imu, index) {
  const quantity = index < 3 ? "SCAL" : "OFFS";
  const prefix = imu === 1 ? "INS_ACC" : imu <= 3 ? `INS_ACC${imu}` : `INS${imu}_ACC`;
  return `${prefix}${quantity}_${AXES[index % 3]}`;
}
