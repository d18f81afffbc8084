// Draws the scene from PhysTex, the page table and CoarseTex, as the native client does (client/core/renderer_gles.cpp):
// unlit triangles, samples resolved in linear light, clear surfaces far faces before near ones.
import {Matrix4} from 'three/src/math/Matrix4.js';
import {Vector3} from 'three/src/math/Vector3.js';

import {kMaxLevels} from '../shared/limits.js';
import type {Chunk, FrameUpdate, InstanceShape, Planes, SceneShape, StreamShape, Vec3} from '../shared/scene.js';
import type {View} from './camera.js';
import {forward, right, up, worldToClip} from './camera.js';
import type {Gl, Program} from './gl_resources.js';
import type {Placed} from './pick.js';
import {Programs} from './programs.js';
import type {Quality} from './quality.js';
import {StreamTextures} from './stream_textures.js';
import {Targets} from './targets.js';

interface ClipControl {
  clipControlEXT(origin: number, depth: number): void;
  readonly LOWER_LEFT_EXT: number;
  readonly ZERO_TO_ONE_EXT: number;
}

// One chunk of one instance.
interface Item extends Placed {
  array: WebGLVertexArrayObject;
  toWorld: Matrix4;
  centre: Vector3;
  distance: number;
}

type Pass = 'depth' | 'colour' | 'stats' | 'through';
type Faces = 'all' | 'backs' | 'fronts';

// What holds for all surfaces of one picture.
interface Frame {
  toClip: Matrix4;
  eye: Vec3;  // recentred
  qPerSample: number;
}


export class Renderer {
  readonly textures: StreamTextures;
  private readonly opaque: Item[] = [];
  private readonly blended: Item[] = [];
  private readonly programs: Programs;
  private readonly targets: Targets;
  private readonly linear: boolean;
  private readonly clipControl: ClipControl | null;
  private readonly emptyArray: WebGLVertexArrayObject;
  private readonly instancesOf = new Map<number, InstanceShape[]>();
  private readonly levels = new Float32Array(kMaxLevels * 4);
  private readonly missing: number;
  private current: Program | null = null;

  constructor(private readonly gl: Gl, private readonly scene: SceneShape, private readonly shape: StreamShape) {
    this.linear = gl.getExtension('EXT_color_buffer_float') !== null ||
                  gl.getExtension('EXT_color_buffer_half_float') !== null;
    this.clipControl = gl.getExtension('EXT_clip_control') as ClipControl | null;
    this.programs = new Programs(gl, this.linear);
    this.targets = new Targets(gl, this.linear);
    this.textures = new StreamTextures(gl, scene);
    // A renderer that is made while a session goes on sees no first frame.
    this.textures.begin(shape, 'shared');
    if (shape.viewSize > 0) this.textures.begin(shape, 'view');
    this.emptyArray = gl.createVertexArray();
    for (const instance of scene.instances) {
      const list = this.instancesOf.get(instance.chart);
      if (list === undefined) this.instancesOf.set(instance.chart, [instance]);
      else list.push(instance);
    }
    scene.levels.forEach((l, i) => this.levels.set([l.density, l.firstTile, l.tilesX, l.tilesY], i * 4));
    const [r, g, b] = scene.background.horizon;
    const grey = Math.min(1, 0.2126 * r + 0.7152 * g + 0.0722 * b);
    this.missing = grey <= 0.0031308 ? grey * 12.92 : 1.055 * grey ** (1 / 2.4) - 0.055;
  }

  get placed(): Iterable<Placed> {
    return [...this.opaque, ...this.blended];
  }

  addChunk(chunk: Chunk): void {
    if (chunk.indices.length === 0) return;
    const gl = this.gl;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, chunk.vertices, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, chunk.indices, gl.STATIC_DRAW);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 24, 0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(1, 2, gl.FLOAT, false, 24, 12);
    gl.enableVertexAttribArray(2);
    gl.vertexAttribIPointer(2, 1, gl.UNSIGNED_INT, 24, 20);
    gl.bindVertexArray(null);
    for (const instance of this.instancesOf.get(chunk.chart) ?? []) {
      const toWorld = new Matrix4().fromArray(instance.toWorld);
      const centre = new Vector3(...chunk.low).add(new Vector3(...chunk.high)).multiplyScalar(0.5).applyMatrix4(toWorld);
      const clear = instance.alphaMode === 'blend' || instance.transmission > 0;
      (clear ? this.blended : this.opaque).push({chunk, instance, array, toWorld, centre, distance: 0});
    }
  }

  apply(update: FrameUpdate): void {
    if (update.fresh) this.textures.begin(this.shape, update.layer);
    this.textures.apply(update);
  }

  putCoarse(picture: Planes): void {
    this.textures.putCoarse(picture);
  }

  /** Draws to the canvas, which has `width` x `height` pixels. */
  draw(view: View, width: number, height: number, quality: Quality): void {
    const gl = this.gl;
    const target = this.targets.of(quality, width, height);
    target.bind();
    this.drawScene(view, width, height, this.scene.q * quality.samples, false);
    target.finish();
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.DEPTH_TEST);
    this.clipControl?.clipControlEXT(this.clipControl.LOWER_LEFT_EXT, 0x935e);  // GL's own depths again
    const exact = quality.samples === 2 && target.width === 2 * width && target.height === 2 * height;
    const program = exact ? this.programs.resolve : this.programs.encode;
    program.use();
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, target.texture);
    gl.uniform1i(program.at('u_samples'), 0);
    gl.bindVertexArray(this.emptyArray);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.bindVertexArray(null);
  }

  /**
   * Draws the classes of samples (client/core/shaders.hpp, SampleClass) into the bound framebuffer of `width` x `height`,
   * each pixel standing for `coarseness` squared of the picture.
   */
  drawClasses(view: View, width: number, height: number, coarseness: number): void {
    this.gl.viewport(0, 0, width, height);
    this.drawScene(view, width, height, this.scene.q / coarseness, true);
  }

  private drawScene(view: View, width: number, height: number, qPerSample: number, stats: boolean): void {
    const gl = this.gl;
    const reversed = this.clipControl !== null;
    this.clipControl?.clipControlEXT(this.clipControl.LOWER_LEFT_EXT, this.clipControl.ZERO_TO_ONE_EXT);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.depthMask(true);
    gl.colorMask(true, true, true, true);
    gl.clearDepth(reversed ? 0 : 1);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.textures.bind();
    const o = this.scene.origin;
    const frame: Frame = {
      toClip: worldToClip(view, this.scene, width / height, reversed),
      eye: [view.position[0] - o[0], view.position[1] - o[1], view.position[2] - o[2]],
      qPerSample,
    };
    const eye = new Vector3(...frame.eye);
    for (const item of this.opaque) item.distance = item.centre.distanceTo(eye);
    for (const item of this.blended) item.distance = item.centre.distanceTo(eye);
    this.opaque.sort((a, b) => a.distance - b.distance);
    this.blended.sort((a, b) => b.distance - a.distance);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(reversed ? gl.GEQUAL : gl.LEQUAL);
    gl.colorMask(false, false, false, false);
    const seen = this.opaque.filter((item) => !outside(item, frame.toClip));
    this.drawItems(frame, seen, 'depth', false);
    gl.colorMask(true, true, true, true);
    const pass = stats ? 'stats' : 'colour';
    this.drawItems(frame, seen, pass, false);
    gl.depthMask(false);
    this.drawBackground(view, width / height, stats);  // at the far plane: only where nothing opaque is
    if (!stats) gl.enable(gl.BLEND);
    this.drawItems(frame, this.blended.filter((item) => !outside(item, frame.toClip)), pass, true);
    gl.disable(gl.BLEND);
    gl.disable(gl.CULL_FACE);
    gl.depthMask(true);
    gl.bindVertexArray(null);
  }

  private drawBackground(view: View, aspect: number, stats: boolean): void {
    const gl = this.gl;
    const program = this.programs.background(stats);
    program.use();
    const half = Math.tan(view.fovy / 2);
    const b = this.scene.background;
    gl.uniform3fv(program.at('u_right'), right(view).map((c) => c * half * aspect));
    gl.uniform3fv(program.at('u_up'), up(view).map((c) => c * half));
    gl.uniform3fv(program.at('u_forward'), forward(view));
    gl.uniform3fv(program.at('u_zenith'), b.zenith);
    gl.uniform3fv(program.at('u_horizon'), b.horizon);
    gl.uniform3fv(program.at('u_ground'), b.ground);
    gl.uniform4fv(program.at('u_sun'), b.sun ? [...b.sun.direction, b.sun.cosine] : [0, 1, 0, 2]);
    gl.uniform3fv(program.at('u_sun_rgb'), b.sun?.rgb ?? [0, 0, 0]);
    gl.uniform1f(program.at('u_depth'), this.clipControl !== null ? 0 : 1);
    gl.disable(gl.CULL_FACE);
    gl.bindVertexArray(this.emptyArray);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  private drawItems(frame: Frame, items: Item[], pass: Pass, blend: boolean): void {
    this.current = null;
    for (const item of items) {
      if (pass === 'depth' && item.instance.alphaMode === 'mask') continue;
      if (blend && pass === 'colour') this.drawBlendedItem(frame, item);
      else this.drawItem(frame, item, pass, blend, 'all');
    }
  }

  // Faces turned away before those turned here, so that a closed body's far side lies under its near one. With the private
  // layer each twice: what is behind is multiplied by what comes through, then their light is added.
  private drawBlendedItem(frame: Frame, item: Item): void {
    const gl = this.gl;
    const clear = item.instance.transmission > 0 && this.textures.hasView;
    for (const faces of ['backs', 'fronts'] as const) {
      if (faces === 'backs' && !item.instance.cameraSeesBack) continue;
      if (!clear) {
        this.setBlending(item.instance);
        this.drawItem(frame, item, 'colour', true, faces);
        continue;
      }
      gl.blendFunc(gl.ZERO, gl.SRC_COLOR);
      this.drawItem(frame, item, 'through', true, faces);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE);
      this.drawItem(frame, item, 'colour', true, faces);
    }
  }

  // Both classes let through what is behind: BLEND by its coverage, thin clear surfaces by tint times transmission.
  private setBlending(instance: InstanceShape): void {
    const gl = this.gl;
    if (instance.transmission > 0) {
      const [r, g, b] = instance.tint.map((c) => c * instance.transmission) as Vec3;
      gl.blendColor(r, g, b, 1);
      gl.blendFunc(gl.ONE, gl.CONSTANT_COLOR);
    } else {
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    }
  }

  private drawItem(frame: Frame, item: Item, pass: Pass, blend: boolean, faces: Faces): void {
    const gl = this.gl;
    const {instance} = item;
    const view = this.textures.hasView && pass !== 'stats';
    const program = pass === 'depth' ? this.programs.depth : this.programs.surface({
      mask: instance.alphaMode === 'mask', blend: blend && instance.alphaMode === 'blend', linear: this.linear,
      stats: pass === 'stats', coarse: this.textures.sharedSize === 0, view, through: pass === 'through'});
    if (program !== this.current) {
      program.use();
      if (pass !== 'depth') this.setFrameUniforms(program, frame);
      this.current = program;
    }
    const matrix = new Matrix4().multiplyMatrices(frame.toClip, item.toWorld);
    gl.uniformMatrix4fv(program.at('u_to_clip'), false, matrix.elements);
    if (pass !== 'depth') {
      gl.uniform1ui(program.at('u_front_base'), instance.frontBase);
      gl.uniform1ui(program.at('u_back_base'), instance.backBase);
      gl.uniform1f(program.at('u_cutoff'), instance.alphaCutoff);
    }
    if (view && pass !== 'depth') {
      const fromEye = item.toWorld.clone();
      for (let axis = 0; axis < 3; ++axis) fromEye.elements[12 + axis]! -= frame.eye[axis]!;
      gl.uniformMatrix4fv(program.at('u_from_eye'), false, fromEye.elements);
      gl.uniform3fv(program.at('u_tint'), instance.tint.map((c) => c * instance.transmission));
      gl.uniform1f(program.at('u_f0'), instance.f0);
    }
    gl.frontFace(instance.flipped ? gl.CW : gl.CCW);  // makes gl_FrontFacing the scene's front
    if (instance.cameraSeesBack && faces === 'all') {
      gl.disable(gl.CULL_FACE);
    } else {
      gl.enable(gl.CULL_FACE);
      gl.cullFace(faces === 'backs' ? gl.FRONT : gl.BACK);
    }
    gl.bindVertexArray(item.array);
    gl.drawElements(gl.TRIANGLES, item.chunk.indices.length, gl.UNSIGNED_INT, 0);
    gl.cullFace(gl.BACK);
  }

  private setFrameUniforms(program: Program, frame: Frame): void {
    const gl = this.gl;
    const t = this.textures;
    gl.uniform4fv(program.at('u_levels'), this.levels);
    gl.uniform1i(program.at('u_level_count'), this.scene.levels.length);
    gl.uniform1ui(program.at('u_patch_count'), this.scene.patchCount);
    gl.uniform1f(program.at('u_q_per_pixel'), frame.qPerSample);
    gl.uniform1f(program.at('u_phys_size'), t.sharedSize || 32);
    gl.uniform1f(program.at('u_chroma_step'), t.chromaStep);
    gl.uniform1f(program.at('u_view_size'), t.viewSize || 32);
    gl.uniform1f(program.at('u_view_chroma_step'), t.viewChromaStep);
    gl.uniform2f(program.at('u_coarse_size'), t.coarse.width, t.coarse.height);
    gl.uniform3f(program.at('u_missing'), this.missing, this.missing, this.missing);
  }
}

// True if all corners of the item's box are outside one plane of the view's pyramid.
function outside(item: Item, toClip: Matrix4): boolean {
  const m = new Matrix4().multiplyMatrices(toClip, item.toWorld).elements;
  const {low, high} = item.chunk;
  const out = [0, 0, 0, 0, 0];
  for (let corner = 0; corner < 8; ++corner) {
    const x = corner & 1 ? high[0] : low[0];
    const y = corner & 2 ? high[1] : low[1];
    const z = corner & 4 ? high[2] : low[2];
    const cx = m[0]! * x + m[4]! * y + m[8]! * z + m[12]!;
    const cy = m[1]! * x + m[5]! * y + m[9]! * z + m[13]!;
    const cw = m[3]! * x + m[7]! * y + m[11]! * z + m[15]!;
    if (cx < -cw) ++out[0]!;
    if (cx > cw) ++out[1]!;
    if (cy < -cw) ++out[2]!;
    if (cy > cw) ++out[3]!;
    if (cw < 0) ++out[4]!;
  }
  return out.includes(8);
}
