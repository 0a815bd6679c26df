/** A session that is none: it answers at once, from the pictures of the site. */
import { Emitter } from "/engine/socket_host.js";
import { array } from "/bench.js";

export class SiteHost extends Emitter {
  requests = [];
  fetched = [];

  constructor(state) {
    super();
    this.state = state;
  }

  async begin() {
    const weights = await array("weights");
    this.emit("state", { kind: "state", ...this.state, arrays: { weights } });
    this.emit("connection", { kind: "connection", state: "open" });
  }

  async send(kind, fields = {}, arrays = {}) {
    this.requests.push({ kind, fields, arrays });
    const made = { kind: kind === "drop" ? "patch" : "answer", arrays: {} };
    this.emit(made.kind, made);
    return made;
  }

  fetch(name) {
    this.fetched.push(name);
    return array(name);
  }

  close() {}
}

/** Until what is looked for is so. */
export async function until(isSo) {
  for (let k = 0; k < 200 && !isSo(); k++) await new Promise((done) => setTimeout(done, 10));
  return isSo();
}
