// Writes the binary `plan` of docs/html-report.md for test pages. It follows the document and not the reporter, so the
// page is tested independently of the reporter.

/** Growing buffer of bytes. */
class Writer {
  constructor() {
    this.bytes = new Uint8Array(1 << 16);
    this.length = 0;
    this.strings = new Map();
  }

  room(count) {
    if (this.length + count <= this.bytes.length) return;
    const grown = new Uint8Array(Math.max(this.bytes.length * 2, this.length + count));
    grown.set(this.bytes);
    this.bytes = grown;
  }

  raw(bytes) {
    this.room(bytes.length);
    this.bytes.set(bytes, this.length);
    this.length += bytes.length;
  }

  u(value) {
    this.room(9);
    let left = value;
    while (left >= 128) {
      this.bytes[this.length++] = (left % 128) + 128;
      left = Math.floor(left / 128);
    }
    this.bytes[this.length++] = left;
  }

  z(value) {
    this.u(value >= 0 ? value * 2 : -value * 2 - 1);
  }

  f(value) {
    const bytes = new Uint8Array(8);
    new DataView(bytes.buffer).setFloat64(0, value, true);
    this.raw(bytes);
  }

  s(text) {
    if (!this.strings.has(text)) this.strings.set(text, this.strings.size);
    this.u(this.strings.get(text));
  }

  list(items, write) {
    this.u(items.length);
    for (const item of items) write(item);
  }
}

const cm = (metres) => Math.round(metres * 100);

/** Writes points `[x, y, level]` in metres. */
function writeLine(writer, points, stations) {
  let [x, y, s] = [0, 0, 0];
  writer.u(points.length);
  points.forEach(([px, py, level], index) => {
    const [nx, ny] = [cm(px), cm(py)];
    writer.z(nx - x);
    writer.z(ny - y);
    if (stations) {
      const ns = cm(stations[index]);
      writer.u(ns - s);
      s = ns;
    }
    const isEnd = index === 0 || index === points.length - 1;
    writer.u(isEnd ? 2 : (level ?? (index % 8 === 0 ? 2 : index % 4 === 0 ? 1 : 0)));
    x = nx;
    y = ny;
  });
}

function writeBorder(writer, border) {
  writeLine(writer, border.points);
  writer.list(border.marks ?? [], (mark) => {
    writer.u(mark.first);
    writer.u(mark.points);
    writer.s(mark.type);
    writer.s(mark.color);
    writer.u(mark.width ?? 12);
  });
}

function writePairs(writer, pairs, signed) {
  let [s, value] = [0, 0];
  writer.list(pairs, ([ps, pv]) => {
    const [ns, nv] = [cm(ps), cm(pv)];
    writer.u(ns - s);
    if (signed) writer.z(nv - value);
    else writer.u(nv);
    s = ns;
    value = nv;
  });
}

function writeLane(writer, lane) {
  writer.z(lane.id);
  writer.s(lane.type);
  writeBorder(writer, lane);
  writePairs(writer, lane.widths, false);
}

function writeRoad(writer, road) {
  writer.s(road.id);
  writer.s(road.name ?? '');
  writer.u((road.junction ?? -1) + 1);
  writer.u(road.flags ?? 0);
  writer.u(cm(road.length));
  writeLine(writer, road.line, road.stations);
  writePairs(writer, road.elevation ?? [], true);
  for (const link of [road.predecessor, road.successor]) {
    writer.u(link?.kind ?? 0);
    writer.s(link?.id ?? '');
  }
  writer.list(road.sections, (section) => {
    writer.u(cm(section.s0));
    writer.u(cm(section.s1));
    writeBorder(writer, section.center);
    writer.list(section.left, (lane) => writeLane(writer, lane));
    writer.list(section.right, (lane) => writeLane(writer, lane));
  });
}

function writeOutline(writer, points) {
  let [x, y] = [0, 0];
  writer.list(points, ([px, py]) => {
    writer.z(cm(px) - x);
    writer.z(cm(py) - y);
    [x, y] = [cm(px), cm(py)];
  });
}

function writeFurniture(writer, plan) {
  writer.list(plan.junctions ?? [], (junction) => {
    for (const text of [junction.id, junction.name ?? '', junction.type ?? 'default']) writer.s(text);
    writer.list(junction.connections ?? [], ([incoming, connecting]) => {
      writer.u(incoming + 1);
      writer.u(connecting + 1);
    });
    writeOutline(writer, junction.outline);
  });
  writer.list(plan.signals ?? [], (signal) => {
    for (const text of [signal.id, signal.name ?? '', signal.type ?? '', signal.subtype ?? '']) writer.s(text);
    writer.u(signal.road);
    writer.u(cm(signal.s));
    for (const value of [cm(signal.t), cm(signal.x), cm(signal.y), Math.round(signal.heading * 1000)]) writer.z(value);
    writer.u(signal.dynamic ? 1 : 0);
  });
  writer.list(plan.objects ?? [], (object) => {
    for (const text of [object.id, object.name ?? '', object.type ?? '']) writer.s(text);
    writer.u(object.road);
    writer.u(cm(object.s));
    writer.z(cm(object.t));
    writeOutline(writer, object.outline);
  });
}

/** Returns the bytes of a plan with coordinates in metres from its origin. */
export function encodePlan(plan) {
  const body = new Writer();
  body.list(plan.roads, (road) => writeRoad(body, road));
  writeFurniture(body, plan);
  body.list(plan.cuts ?? [], (cut) => body.s(cut));
  const head = new Writer();
  head.raw(new TextEncoder().encode('QCPL'));
  head.u(1);
  head.f(plan.origin[0]);
  head.f(plan.origin[1]);
  head.list([...body.strings.keys()], (text) => {
    const bytes = new TextEncoder().encode(text);
    head.u(bytes.length);
    head.raw(bytes);
  });
  head.raw(body.bytes.subarray(0, body.length));
  return head.bytes.slice(0, head.length);
}
