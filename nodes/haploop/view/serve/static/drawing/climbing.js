// The unit of an axis, which climbs with its numbers: µJ, mJ, J, kJ. It does not flicker: it stays as long as it fits.

const STEPS = [[1e-9, "n"], [1e-6, "µ"], [1e-3, "m"], [1, ""], [1e3, "k"], [1e6, "M"], [1e9, "G"]];
// Numbers of an axis lie between these; the unit is kept a little below, so that numbers near the least one do not change it.
const [LEAST, MOST, SLACK] = [0.1, 1000, 2];
// Units that take a prefix: not kg, no power ("mm^2" would be another unit), no pure number.
const TAKES = /^(A|Hz|J|N|Pa|V|W|g|m|rad|s)($|[ /])/;

export class ClimbingUnit {
  /**
   * @param {string} unit in SI.
   * @param {string} letter of the prefix to begin with.
   */
  constructor(unit, letter) {
    this.unit = unit;
    this.step = STEPS.find(([, one]) => one === letter);
  }

  /** From SI to this unit. */
  get factor() {
    return 1 / this.step[0];
  }

  get name() {
    return this.step[1] + this.unit;
  }

  /** Take a unit that fits numbers up to this size in SI; whether that is another unit. */
  serve(largest) {
    const size = largest / this.step[0];
    if (!TAKES.test(this.unit) || !(largest > 0 && Number.isFinite(largest)) || (size >= LEAST / SLACK && size < MOST)) return false;
    const before = this.step;
    this.step = STEPS.findLast(([factor]) => largest >= LEAST * factor) ?? STEPS[0];
    return this.step !== before;
  }
}
