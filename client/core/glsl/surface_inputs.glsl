in vec2 v_uv;
flat in uint v_patch;
uniform usampler2D u_places;   // x, y, bits of scale; level-major, 2048 wide
uniform usampler2D u_pages;    // slots of all tiles, 2048 wide
uniform vec4 u_levels[16];     // density, first tile, tiles_x, tiles_y
uniform int u_level_count;
uniform uint u_patch_count;
uniform uint u_front_base;
uniform uint u_back_base;      // 0xffffffff: none
uniform float u_q_per_pixel;   // q * samples per pixel on an axis
uniform float u_phys_size;     // pixels
uniform vec2 u_coarse_size;    // pixels; 0: none yet
uniform vec3 u_missing;        // colour where there is no light yet
uniform float u_cutoff;
#ifdef LOSSLESS
uniform sampler2D u_rgb;
#else
uniform sampler2D u_y;
uniform sampler2D u_cb;
uniform sampler2D u_cr;
uniform float u_chroma_step;   // 0.5: 4:2:0, 1: 4:4:4
#endif
#ifdef VIEW
uniform usampler2D u_view_pages;
uniform float u_view_size;     // pixels
#ifdef LOSSLESS
uniform sampler2D u_view_rgb;
#else
uniform sampler2D u_view_y;
uniform sampler2D u_view_cb;
uniform sampler2D u_view_cr;
uniform float u_view_chroma_step;
#endif
#endif
#ifdef VIEW
in vec3 v_from_eye;            // world axes
uniform float u_f0;            // 0: nothing is dimmed by Fresnel's term
#endif
#ifdef THROUGH
uniform sampler2D u_through;
uniform vec3 u_tint;           // passed where no private tile says better
#endif
uniform sampler2D u_coverage;
uniform sampler2D u_coarse_coverage;
uniform sampler2D u_coarse_y;
uniform sampler2D u_coarse_cb;
uniform sampler2D u_coarse_cr;
out vec4 o_colour;
