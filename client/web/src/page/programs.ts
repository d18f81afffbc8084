// The surface programs: the same shader texts as the native client's, put together by what a surface asks for.
import background from '../glsl/background.glsl';
import colour from '../glsl/colour.glsl';
import fullscreenVertex from '../glsl/fullscreen_vertex.glsl';
import header from '../glsl/header.glsl';
import resolve from '../glsl/resolve.glsl';
import surface from '../glsl/surface.glsl';
import surfaceInputs from '../glsl/surface_inputs.glsl';
import surfaceVertex from '../glsl/surface_vertex.glsl';

import type {Gl} from './gl_resources.js';
import {Program} from './gl_resources.js';

/** Every combination is a program of its own, so that none pays for what it does not do (client/core/shaders.hpp). */
export interface SurfaceVariant {
  mask: boolean;
  blend: boolean;
  /** The target holds linear light (half floats), else sRGB-encoded bytes. */
  linear: boolean;
  /** Writes the class of each sample instead of its colour. */
  stats: boolean;
  /** Nothing but CoarseTex is there: without the walk down the levels a program is ready the sooner. */
  coarse: boolean;
  /** Adds the private layer. */
  view: boolean;
  /** Writes what a clear surface passes of the light behind it. */
  through: boolean;
}

// Copies a target of one sample a pixel to the screen, of whatever size.
const kEncode = `
uniform sampler2D u_samples;
in vec2 v_ndc;
out vec4 o_colour;
void main() {
  vec3 c = clamp(texture(u_samples, v_ndc * 0.5 + 0.5).rgb, 0.0, 1.0);
#ifdef LINEAR
  c = to_srgb(c);
#endif
  o_colour = vec4(c, 1.0);
}
`;

/** Texture units the surface programs read from, by the sampler's name. */
export const kUnits = ['u_places', 'u_pages', 'u_y', 'u_cb', 'u_cr', 'u_coverage', 'u_coarse_y', 'u_coarse_cb',
  'u_coarse_cr', 'u_view_pages', 'u_view_y', 'u_view_cb', 'u_view_cr', 'u_through', 'u_coarse_coverage'] as const;

export class Programs {
  private readonly surfaces = new Map<string, Program>();
  private readonly others = new Map<string, Program>();

  constructor(private readonly gl: Gl, private readonly linear: boolean) {}

  surface(variant: SurfaceVariant): Program {
    const defines = (Object.keys(variant) as (keyof SurfaceVariant)[]).filter((name) => variant[name]);
    const key = defines.join(' ');
    let program = this.surfaces.get(key);
    if (program === undefined) {
      const head = header + defines.map((name) => `#define ${name.toUpperCase()}\n`).join('');
      program = new Program(this.gl, header + (variant.view ? '#define VIEW\n' : '') + surfaceVertex,
                            head + surfaceInputs + colour + surface);
      program.use();
      kUnits.forEach((name, unit) => this.gl.uniform1i(program!.at(name), unit));
      this.surfaces.set(key, program);
    }
    return program;
  }

  /** Positions only: fills the depth buffer, so that each sample is shaded once. */
  get depth(): Program {
    return this.other('depth', surfaceVertex, 'void main() {}\n');
  }

  background(stats: boolean): Program {
    return this.other(stats ? 'background stats' : 'background', fullscreenVertex,
                      (stats ? '#define STATS\n' : '') + this.define() + colour + background);
  }

  /** Averages 2x2 samples in linear light and encodes. */
  get resolve(): Program {
    return this.other('resolve', fullscreenVertex, this.define() + colour + resolve);
  }

  get encode(): Program {
    return this.other('encode', fullscreenVertex, this.define() + colour + kEncode);
  }

  private define(): string {
    return this.linear ? '#define LINEAR\n' : '';
  }

  private other(name: string, vertex: string, fragment: string): Program {
    let program = this.others.get(name);
    if (program === undefined) {
      program = new Program(this.gl, header + vertex, header + fragment);
      this.others.set(name, program);
    }
    return program;
  }
}
