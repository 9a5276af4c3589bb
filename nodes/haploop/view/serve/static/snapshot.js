// A snapshot as it comes from the server: a header, then every column of every table as 32-bit floats.

const utf8 = new TextDecoder();

/**
 * Decode a snapshot.
 *
 * @param {ArrayBuffer} buffer uint32 length of the header (little-endian), the header as JSON, then the tables.
 * @returns {object} from_s, to_s and tables: name -> {t0_s, dt_s, rows, envelope, columns: [{name, unit, label, values,
 *   last}]}; last: the newest value, where it is known apart from the values
 */
export function decode(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(utf8.decode(new Uint8Array(buffer, 4, length)));
  const tables = {};
  let at = 4 + length;
  for (const table of header.tables) {
    const columns = table.columns.map((column, i) => ({
      ...column,
      ...(table.last?.length ? { last: table.last[i] } : {}),
      values: new Float32Array(buffer, at + 4 * table.rows * i, table.rows),
    }));
    tables[table.name] = { ...table, columns };
    at = (at + 4 * table.rows * columns.length + 7) & ~7;
  }
  return { ...header, tables };
}

/** The times of a table's rows, in s. */
export function times(table) {
  const t = new Float64Array(table.rows);
  for (let i = 0; i < t.length; i++) t[i] = table.t0_s + i * table.dt_s;
  return t;
}

/** A column in another unit. */
export function scaled(values, factor) {
  if (factor === 1) return values;
  const other = new Float64Array(values.length);
  for (let i = 0; i < other.length; i++) other[i] = values[i] * factor;
  return other;
}

/** The newest number that a column has; NaN if it has none. */
export function newest({ values, last }) {
  if (last !== undefined) return last ?? NaN;
  let i = values.length - 1;
  while (i > 0 && Number.isNaN(values[i])) i--;
  return values[i] ?? NaN;
}
