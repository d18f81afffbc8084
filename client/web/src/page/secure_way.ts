// Where a page that is not in a secure context finds one: said as its server has it, not as one hopes.
import type {Sentence} from './requirements.js';

const kWhy = 'Browsers decode the picture over a secure connection only';
const kAskMs = 3000;

function portOf(url: URL): number {
  return url.port !== '' ? Number(url.port) : url.protocol === 'https:' ? 443 : 80;
}

/**
 * `httpsPort`: where the server speaks HTTPS; 0: nowhere; null: it did not say. On another port than the page's there is
 * something between the two, and only who put it there knows what it speaks.
 */
export function secureWay(href: string, httpsPort: number | null): Sentence {
  const url = new URL(href);
  const port = portOf(url);
  if (httpsPort === 0) {
    return {text: `${kWhy}, and this server has no HTTPS: open http://localhost:${port}/ on its own machine, or have HTTPS ` +
                  'turned on there (tls.enabled, or a reverse proxy).'};
  }
  if (httpsPort !== port) return {text: `${kWhy}: please ask who runs this server for its HTTPS address.`};
  url.protocol = 'https:';
  url.port = String(port);
  return {
    text: `${kWhy}: open this page by HTTPS (the browser may ask whether you trust this server's own certificate).`,
    link: {href: url.href, label: `${url.host} over HTTPS`},
  };
}

/** What the server of this page says of itself. */
export async function askHttpsPort(href: string): Promise<number | null> {
  try {
    const reply = await fetch(new URL('/healthz', href), {signal: AbortSignal.timeout(kAskMs), cache: 'no-store'});
    const told = await reply.json() as {https_port?: unknown};
    return typeof told.https_port === 'number' ? told.https_port : null;
  } catch {
    return null;
  }
}
