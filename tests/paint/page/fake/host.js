/** A session that is made up: it answers as the protocol says, by a few steps towards the paint. */

const flat = (weights) => ({
  weights: { data: Float64Array.from(weights.flat()), shape: [weights.length, 3] },
});

/** As halves: sign, five bits of exponent, ten of mantissa; rounded down. */
function halves(floats) {
  const bits = new Uint32Array(Float32Array.from(floats).buffer);
  return Uint16Array.from(bits, (x) => {
    const exponent = ((x >>> 23) & 255) - 112;
    return exponent <= 0 ? 0 : (Math.min(30, exponent) << 10) | ((x >>> 13) & 1023);
  });
}

export class FakeHost {
  constructor(room, { isFirst, isElsewhere }) {
    Object.assign(this, {
      room,
      isFirst,
      isElsewhere,
      requests: [],
      hearers: {},
      looks: [],
      ids: 0,
      stroke: 0,
    });
    this.references = [];
    this.renders = [];
    this.weights = room.lights.map(({ present }) => [...present]);
    this.constraints = {};
    this.ties = [];
    this.settings = {
      hold: null,
      space: null,
      colors: null,
      literal: false,
      prefer_current: 0,
      sparse: null,
    };
    this.steps = [];
    this.undone = [];
    this.resources = Object.fromEntries(room.lights.map((_, k) => [`thumb/${k}`, 1]));
    Object.assign(this.resources, {
      albedo: 1,
      objects: 1,
      present: 1,
      painting: 1,
      importance: 1,
    });
    room.lights.forEach((_, k) => {
      this.resources[`plane/${k}`] = 1;
    });
    this.original = this.mixed();
  }

  on(kind, hear) {
    (this.hearers[kind] ??= []).push(hear);
  }
  tell(message) {
    for (const hear of this.hearers[message.kind] ?? []) hear(message);
  }
  open() {
    const text = 'the painter is open in another tab';
    this.tell(this.isElsewhere ? { kind: 'closed', reason: 'taken', text } : this.state());
  }
  close() {}

  /** Every message is answered, a little later; tests may have it fail, or wait. */
  async send(kind, fields = {}, arrays = {}) {
    this.requests.push({ kind, ...fields });
    this.busy = (this.busy ?? 0) + 1;
    await new Promise((done) => setTimeout(done, 1));
    const failed = (text) => ({ kind: 'failed', text });
    const made = this.fails
      ? failed(this.fails)
      : (this[kind]?.(fields, arrays) ?? failed(`no ${kind}`));
    this.fails = null;
    const reply = { arrays: {}, ...made, reply: this.requests.length };
    this.tell(reply);
    this.busy -= 1;
    return reply;
  }

  state() {
    const { room } = this;
    return {
      kind: 'state',
      version: 3,
      size: [room.h, room.w],
      scene: 'gallery',
      can_report: true,
      is_back: false,
      verifications: [],
      command: '',
      lut: { side: 2, low: 0, high: 1 },
      views: [
        {
          name: '',
          size: [room.h, room.w],
          objects: room.objects,
          scales: room.lights.map(() => 1),
          plane_size: [room.h, room.w],
        },
      ],
      lights: room.lights.map(({ name, present }, k) => ({
        name,
        label: name,
        unit: 'W/(m² sr)',
        parameter: 'radiance',
        plugin: 'area',
        form: 'rgb',
        members: [name],
        present,
        scale: 1,
        is_fixed: false,
        is_scalar: false,
        emitters: [],
        group: room.n > 12 && k >= 8 ? `Row ${'ABCDEFG'[Math.floor((k - 8) / 8)] ?? 'H'}` : null,
      })),
      images: [],
      objects: room.objects,
      transforms: ['srgb', 'filmic', 'agx', 'linear'],
      transform: { name: 'srgb', stops: 0 },
      resources: this.resources,
      can_render: true,
      stroke: 0,
      looks: this.looks,
      references: this.references,
      renders: this.renders,
      presets: [
        ['moonlight', 'Moonlight', false],
        ['only_object', 'Only this object', true],
      ].map(([name, title, has_subject]) => ({
        name,
        title,
        description: 'What it asks for',
        has_subject,
      })),
      basis: this.isFirst
        ? { spp: 4, target_spp: 64, is_complete: false }
        : { spp: 64, target_spp: 64, is_complete: true },
      is_new: !this.steps.length,
      folder: '/shows/gallery-evening',
      answer: this.exact(),
      ...this.asks(),
      arrays: flat(this.weights),
    };
  }

  asks() {
    return {
      constraints: this.constraints,
      ties: this.ties,
      settings: this.settings,
      master: this.master ?? 1,
      effective_settings: { space: 'display', hold: 3, colors: 'gentle' },
      history: {
        undo: this.steps.map(({ label }) => label),
        redo: this.undone.map(({ label }) => label),
        count: this.steps.length,
      },
    };
  }

  exact() {
    const level = (rgb) => 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
    const total = this.weights.reduce((sum, rgb) => sum + level(rgb), 1e-9);
    return {
      headline: this.steps.length
        ? 'Close to what was painted; the floor stays too dark.'
        : 'The current lighting.',
      delta_e: this.steps.length ? 2.31 : 0,
      sentences: ['3 lights changed by more than a stop.', 'The key light does most of it.'],
      lights: this.weights.map((rgb, k) => ({
        emission: rgb,
        stops: null,
        kelvin: 2400 + 377 * k,
        swatch: '#ffcc88',
        is_on: true,
        share: level(rgb) / total,
        error: '±4 %',
        is_constrained: false,
        is_unreached: k === 11,
      })),
    };
  }

  answer(isExact = true) {
    return {
      kind: 'answer',
      stroke: this.stroke,
      exact: isExact,
      mode: 'linear',
      version: (this.version = (this.version ?? 0) + 1),
      ...(isExact ? { ...this.exact(), ...this.asks() } : {}),
      arrays: flat(this.weights),
    };
  }

  patch() {
    // What is known of the answer comes by itself, later.
    setTimeout(() => this.tell(this.answer()));
    return {
      kind: 'patch',
      version: (this.version = (this.version ?? 0) + 1),
      region: [0, 0, 0, 0],
      view: 0,
      views: [],
      stroke: this.stroke,
      exact: false,
      mode: 'linear',
      ...this.asks(),
      arrays: flat(this.weights),
    };
  }
  step(label, undo) {
    this.stepCount = (this.stepCount ?? 0) + 1;
    this.steps.push({ id: this.stepCount, label, undo });
    this.undone = [];
  }

  /** A step towards the paint: each light by how far it looks like what was painted since. */
  paint({ stroke, region: [top, , left], is_final, label }, { image }) {
    this.stroke = stroke;
    if (is_final) this.step(label);
    // The mask of a layer has no light to solve for.
    if (!image) return this.answer(Boolean(is_final));
    const { w, planes, lights } = this.room;
    const [rows, columns] = image.shape;
    const mixed = this.mixed();
    this.weights = this.weights.map((rgb, k) =>
      rgb.map((x, c) => {
        if (this.constraints[lights[k].name]?.lock) return x;
        let [up, own] = [0, 1e-9];
        for (let i = 0; i < rows * columns; i += 5) {
          const at = 3 * ((top + Math.floor(i / columns)) * w + left + (i % columns)) + c;
          if (Math.abs(image.data[3 * i + c] - this.original[at]) > 1e-3)
            up += (image.data[3 * i + c] - mixed[at]) * planes[k][at];
          own += planes[k][at] ** 2;
        }
        return Math.max(0, x + (0.3 * up) / own);
      }),
    );
    return this.answer(Boolean(is_final));
  }

  mixed() {
    const made = new Float32Array(this.room.w * this.room.h * 3);
    this.room.planes.forEach((plane, k) => {
      for (let i = 0; i < made.length; i += 1) made[i] += plane[i] * this.weights[k][i % 3];
    });
    return made;
  }

  /** Also what a drag has changed. */
  drop_stroke() {
    Object.assign(this, this.atRest);
    this.atRest = null;
    return this.patch();
  }
  undo() {
    const step = this.steps.pop();
    if (!step) return { kind: 'failed', text: 'There is nothing to undo.', tone: 'info' };
    this.undone.push(step);
    return this.patch();
  }
  redo() {
    const step = this.undone.pop();
    if (step) this.steps.push(step);
    return this.patch();
  }
  list_steps({ count }) {
    const all = [...this.steps, ...this.undone.toReversed()];
    return {
      kind: 'steps',
      steps: all.slice(-count).map(({ id, label }) => ({
        id,
        label,
        stamp: 1.7e9 + 60 * id,
        is_milestone: id % 20 === 0,
      })),
      earlier: Math.max(0, all.length - count),
      done: this.steps.at(-1)?.id ?? 0,
    };
  }
  show_previous() {
    return { kind: 'previous', arrays: flat(this.weights.map(() => [0, 0, 0])) };
  }
  go_to_step({ step }) {
    const all = [...this.steps, ...this.undone.toReversed()];
    const count = all.findIndex(({ id }) => id === step) + 1;
    this.steps = all.slice(0, count);
    this.undone = all.slice(count).toReversed();
    return this.patch();
  }
  apply_preset({ preset }) {
    this.step(preset);
    return this.patch();
  }
  look_like({ reference }) {
    this.step(`Like ${this.references.find(({ id }) => id === reference)?.name}`);
    return this.patch();
  }
  add_reference({ name, size, start }, { part }) {
    if (start + part.data.length < size) return { kind: 'started', task: 'reference' };
    const id = (this.references.at(-1)?.id ?? 0) + 1;
    this.references = [...this.references, { id, name: name.replace(/\.[^.]*$/, '') }];
    setTimeout(() => this.tell({ ...this.referenceList(), arrays: {} }), 1);
    return { kind: 'started', task: 'reference' };
  }
  drop_reference({ reference }) {
    this.references = this.references.filter(({ id }) => id !== reference);
    return this.referenceList();
  }
  referenceList() {
    return { kind: 'references', references: this.references };
  }
  clear_painting() {
    this.step('clear painting');
    return this.patch();
  }
  start_over() {
    this.step('start over');
    return this.patch();
  }
  constrain_light({ light, constraints, is_final }) {
    this.constraints = { ...this.constraints, [this.room.lights[light].name]: constraints };
    if (Array.isArray(constraints.lock)) this.weights[light] = [...constraints.lock];
    if (constraints.off) this.weights[light] = [0, 0, 0];
    if (is_final) this.step('constraint');
    return this.answer(is_final);
  }
  constrain_lights({ constraints, label = 'constraint', is_final = true }) {
    const { constraints: before, weights } = this;
    this.atRest = is_final ? null : (this.atRest ?? { constraints: before, weights: [...weights] });
    this.constraints = { ...this.constraints, ...constraints };
    this.room.lights.forEach(({ name }, k) => {
      const { lock, off } = constraints[name] ?? {};
      if (Array.isArray(lock)) this.weights[k] = [...lock];
      if (off) this.weights[k] = [0, 0, 0];
    });
    if (is_final) this.step(label);
    return this.answer(is_final);
  }
  set_master({ level }) {
    this.master = level;
    this.step(`master ${Math.round(100 * level)} %`);
    return this.answer();
  }
  tie({ ties }) {
    this.ties = ties;
    return this.answer();
  }
  change_settings({ settings }) {
    this.settings = { ...this.settings, ...settings };
    return this.answer();
  }
  kept() {
    return { kind: 'looks', looks: [...this.looks], resources: this.resources };
  }
  save_look({ name }) {
    const id = (this.ids += 1);
    this.looks.push({
      id,
      name,
      lights: this.room.lights.map((light) => light.name),
      weights: this.weights.map((rgb) => [...rgb]),
      places: '',
      stamp: 0,
      thumbnail: `look/${id}`,
      is_proposal: false,
    });
    return this.kept();
  }
  load_look({ look }) {
    this.weights = this.looks.find(({ id }) => id === look).weights.map((rgb) => [...rgb]);
    this.step('look');
    return this.patch();
  }
  rename_look({ look, name }) {
    this.looks = this.looks.map((one) => (one.id === look ? { ...one, name } : one));
    return this.kept();
  }
  copy_look({ look }) {
    const one = this.looks.find(({ id }) => id === look);
    this.looks.push({ ...one, id: (this.ids += 1), name: `${one.name} 2` });
    return this.kept();
  }
  mix_looks({ first, second, part, name }) {
    const [a, b] = [first, second].map((look) => this.looks.find(({ id }) => id === look));
    const id = (this.ids += 1);
    const weights = a.weights.map((rgb, k) =>
      rgb.map((x, c) => (1 - part) * x + part * b.weights[k][c]),
    );
    this.looks.push({ ...b, id, name, weights });
    return this.kept();
  }
  drop_look({ look }) {
    this.looks = this.looks.filter(({ id }) => id !== look);
    return this.kept();
  }
  export({ outputs, run = true, name = '' }) {
    if (this.isWriting) return { kind: 'started', task: run ? 'export' : 'stop' };
    const files = this.unpainted ? outputs.filter((one) => !['target', 'report'].includes(one)) : outputs;
    return {
      kind: 'exported',
      files: files.map((one) => `/shows/gallery-evening/${name && `exports/${name}/`}${one}`),
      command: files.includes('target')
        ? 'lightpaint solve gallery.xml gallery-evening/target.exr'
        : '',
      is_unpainted: files.length < outputs.length,
    };
  }
  render_final({ name, width, spp, formats, view = 0 }) {
    const id = 1 + Math.max(0, ...this.renders.map((render) => render.id));
    const state = this.renders.some((render) => render.state === 'rendering')
      ? 'waiting'
      : 'rendering';
    const asked = { id, name, width, spp, formats, view, state };
    this.renders = [
      ...this.renders,
      { ...asked, height: null, done: 0, total: 0, text: '', files: [] },
    ];
    return { kind: 'renders', renders: this.renders };
  }
  stop_render({ render }) {
    return this.changeRender(render, { state: 'stopped' });
  }
  drop_render({ render }) {
    this.renders = this.renders.filter(({ id }) => id !== render);
    return { kind: 'renders', renders: this.renders };
  }
  changeRender(render, changes) {
    this.renders = this.renders.map((one) => (one.id === render ? { ...one, ...changes } : one));
    return { kind: 'renders', renders: this.renders };
  }
  verify({ run }) {
    return run
      ? { kind: 'progress', task: 'verify', done: 3, total: 16, unit: 'passes' }
      : { kind: 'notice', text: 'The render was stopped.', tone: 'info' };
  }
  explain() {
    return {
      kind: 'explained',
      view: 0,
      is_old: false,
      sentences: ['No light reaches the floor at the left.', 'The cove is at its limit.'],
    };
  }
  preview({ number, view }) {
    const picture = { data: new Uint8Array(9 * 16 * 3).fill(90), shape: [9, 16, 3] };
    setTimeout(() =>
      this.tell({
        kind: 'previewed',
        number,
        view,
        text: 'Comes closer to the paint (mean ΔE 4.1 instead of 11), and changes the annex by ΔE 49. That is more than it gains.',
        is_at_cost: true,
        is_old: false,
        arrays: { before: picture, after: picture },
      }),
    );
    return { kind: 'started', task: 'preview' };
  }
  show_rig() {
    return { kind: 'started', task: 'rig' };
  }
  take_over() {
    return this.state();
  }

  async fetch(name) {
    const [kind, at] = name.split('/');
    const { w, h, planes, n, surfaces } = this.room;
    if (kind === 'plane') return { data: halves(planes[at]), shape: [h, w, 3] };
    if (kind === 'present') return { data: halves(this.original), shape: [h, w, 3] };
    if (kind === 'painting') return { data: this.original.slice(), shape: [h, w, 3] };
    if (kind === 'importance') return { data: new Float32Array(w * h), shape: [h, w] };
    if (kind === 'albedo')
      return {
        data: halves(Float32Array.from(surfaces.flatMap(({ albedo }) => albedo))),
        shape: [h, w, 3],
      };
    if (kind === 'objects')
      return { data: Int16Array.from(surfaces, ({ object }) => object), shape: [h, w] };
    const weights =
      kind === 'thumb'
        ? this.room.lights.map((_, k) =>
            k === Number(at) ? [8 / n, 8 / n, 8 / n].map((x) => (x * n) / 8) : [0, 0, 0],
          )
        : (this.looks.find((one) => one.thumbnail === name)?.weights ?? this.weights);
    const small = [Math.ceil(h / 2), Math.ceil(w / 2)];
    const data = new Uint8Array(small[0] * small[1] * 3);
    for (let y = 0; y < small[0]; y += 1)
      for (let x = 0; x < small[1]; x += 1)
        for (let c = 0; c < 3; c += 1) {
          const from = 3 * (2 * y * w + 2 * x) + c;
          const light = planes.reduce(
            (sum, plane, k) => sum + (weights[k][c] ? weights[k][c] * plane[from] : 0),
            0,
          );
          data[3 * (y * small[1] + x) + c] = 255 * Math.min(1, light) ** (1 / 2.2);
        }
    return { data, shape: [...small, 3] };
  }
}
