// Nobody looks at a page that is hidden: after a while it lets its session go, and has one again once it is shown.

/** Long enough that looking something up in another tab costs nobody a new session. */
export const kLeaveAfterMs = 10_000;
/** A scene that is still coming is waited for, since it would come all over again; but not for ever. */
export const kSceneComesMs = 120_000;

export interface PresenceOwner {
  /** All of the scene's geometry is here: a new session will not send it again. */
  sceneIsHere(): boolean;
  /** Gives the session up, without a word to the visitor: the picture stays. */
  leave(): void;
  /** Takes it up again where the visitor stands. */
  comeBack(): void;
}

export class Presence {
  private timer = 0;
  private hiddenAt = 0;
  private left = false;

  constructor(private readonly owner: PresenceOwner) {}

  /** The page cannot be seen, or can be. */
  seen(visible: boolean): void {
    clearTimeout(this.timer);
    if (!visible) {
      this.hiddenAt = performance.now();
      this.leaveLater();
    } else if (this.left) {
      this.left = false;
      this.owner.comeBack();
    }
  }

  /** The browser puts the page away: it may never run again. */
  putAway(): void {
    clearTimeout(this.timer);
    if (this.left) return;
    this.left = true;
    this.owner.leave();
  }

  private leaveLater(): void {
    this.timer = self.setTimeout(() => {
      const waited = performance.now() - this.hiddenAt >= kSceneComesMs;
      if (waited || this.owner.sceneIsHere()) this.putAway();
      else this.leaveLater();
    }, kLeaveAfterMs);
  }
}

/** Tells `owner` of this document's comings and goings. */
export function watchPresence(owner: PresenceOwner): void {
  const presence = new Presence(owner);
  const look = (): void => presence.seen(document.visibilityState === 'visible');
  document.addEventListener('visibilitychange', look);
  window.addEventListener('pagehide', () => presence.putAway());
  window.addEventListener('pageshow', (e) => {
    if (e.persisted) presence.seen(true);  // kept by the browser, and gone back to
  });
  if (document.visibilityState !== 'visible') look();
}
