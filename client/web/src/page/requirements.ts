// What a browser must have, and what to tell who has it not: one sentence with the way out.
import {secureWay} from './secure_way.js';

export interface Sentence {
  text: string;
  /** Where the way out is, if it is a place. */
  link?: {href: string; label: string};
  /** The way out is to load the page anew. */
  reload?: true;
}

export interface Surroundings {
  secure: boolean;
  webCodecs: boolean;
  webGl2: boolean;
  webAssembly: boolean;
  /** The page's address. */
  href: string;
  /** Where its server speaks HTTPS; 0: nowhere; null: not known. Matters where the context is not secure. */
  httpsPort: number | null;
}

/** Null: everything is there. */
export function whatIsMissing(here: Surroundings): Sentence | null {
  if (!here.webCodecs && !here.secure) return secureWay(here.href, here.httpsPort);
  if (!here.webCodecs) {
    return {text: 'This browser cannot decode the picture (it has no WebCodecs): please use a current Chrome, Edge, ' +
                  'Safari or Firefox.'};
  }
  if (!here.webGl2) {
    return {text: 'This browser cannot draw the scene (it has no WebGL 2): please turn on hardware acceleration in its ' +
                  'settings, or use another browser.'};
  }
  if (!here.webAssembly) {
    return {text: 'This browser cannot unpack the scene (it has no WebAssembly): please allow it in its settings, or use ' +
                  'another browser.'};
  }
  return null;
}
