// The page's few buttons, and the keys that do the same.
import type {Help} from './help.js';
import type {Notices} from './notices.js';
import type {Mode} from './rig.js';

export interface ButtonsOwner {
  toggleMode(): void;
  togglePanel(): void;
  goToStart(): void;
  /** The link in the address bar is that of the view. */
  writeLink(): void;
}

function element(id: string): HTMLElement {
  return document.getElementById(id)!;
}

export class Buttons {
  private readonly nav = element('buttons');
  private readonly mode = element('mode');

  constructor(private readonly owner: ButtonsOwner, private readonly help: Help, private readonly notices: Notices) {
    this.mode.addEventListener('click', () => owner.toggleMode());
    element('share').addEventListener('click', () => void this.share());
    element('show-panel').addEventListener('click', () => owner.togglePanel());
    window.addEventListener('keydown', (e) => this.key(e));
  }

  /** Whether there is a scene for hands to move in: without one no button and no key would do anything. */
  offer(useful: boolean): void {
    this.nav.hidden = !useful;
    element('scene').tabIndex = useful ? 0 : -1;
    if (!useful && this.help.open) this.help.toggle();
  }

  showMode(mode: Mode): void {
    const orbit = mode === 'orbit';
    this.mode.textContent = orbit ? 'Orbit' : 'Walk';
    this.mode.setAttribute('aria-label', orbit ? 'Moving: orbit' : 'Moving: walk');
  }

  private key(e: KeyboardEvent): void {
    if (e.ctrlKey || e.metaKey || e.altKey || e.repeat || this.nav.hidden) return;
    // By what it writes: it is elsewhere on each keyboard.
    if (e.key === '?') this.help.toggle();
    else if (this.help.open) return;
    else if (e.code === 'KeyP') this.owner.togglePanel();
    else if (e.code === 'KeyO') this.owner.toggleMode();
    else if (e.code === 'KeyH') this.bare();
    else if (e.code === 'Home') this.owner.goToStart();
  }

  private bare(): void {
    const bare = document.body.classList.toggle('bare');
    this.notices.quiet(bare ? 'H brings the buttons back.' : '', bare ? 3 : 0);
  }

  private async share(): Promise<void> {
    this.owner.writeLink();
    try {
      await navigator.clipboard.writeText(location.href);
      const elsewhere = !/^(localhost|127\..*|\[::1\])$/.test(location.hostname);
      this.notices.quiet(elsewhere ? 'The link to this view is copied.' :
        'The link to this view is copied. It opens on this machine alone: others need its name in place of ' +
        `${location.hostname}, and https.`, elsewhere ? 3 : 8);
    } catch {
      this.notices.quiet('The link to this view is in the address bar.', 5);
    }
  }
}
