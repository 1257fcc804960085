// Buttons and keys: what cannot be done is disabled, and says why.
'use strict';

const kSaidStays_ms = 6000;
const kHints = {
  pause: 'Pause (space)', resume: 'Go on (space)', step: 'One frame, then pause (right arrow while paused)',
  slower: 'Half the speed', faster: 'Twice the speed', save: 'Write the map file now',
  reset: 'Forget map and trajectory and begin anew', stop: 'End the run; it writes its files',
};

class Drive {
  constructor(call, record) {
    this.buttons = [...document.querySelectorAll('#drive button')];
    this.refusals = {};
    this.isPaused = false;
    for (const b of this.buttons) b.addEventListener('click', () => this.ask(b, call));
    this.refuseAll('not connected');
    addEventListener('keydown', (e) => this.key(e, record));
  }
  refuseAll(why) { this.tell({}, () => why); }
  /// What the run said of itself: of each service why it would refuse, or nothing.
  tell(values, why = (service) => values[service] ?? 'not told yet') {
    this.isPaused = values['goes on'] === 'false';
    const play = $('play');
    play.dataset.service = this.isPaused ? 'resume' : 'pause';
    play.textContent = this.isPaused ? 'Play' : 'Pause';
    $('speed').textContent = values.speed ?? 'speed';
    for (const b of this.buttons) {
      const refusal = why(b.dataset.service);
      b.disabled = refusal !== '';
      b.title = refusal || kHints[b.dataset.service];
      b.setAttribute('aria-description', b.title);
    }
  }
  ask(button, call) { say(`${button.dataset.service} ...`); call(button.dataset.service); }

  key(event, record) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.matches('select, input:not([type=checkbox])') && event.target.id !== 'scrub') return;
    // Who goes through the page by keyboard presses what has the focus.
    if (event.key === ' ' && event.target.matches('button:focus-visible, input:focus-visible')) return;
    const act = {
      ' ': () => this.press($('play')),
      ArrowRight: () => record.cursor === null && this.isPaused ? this.press(document.querySelector('[data-service=step]')) : record.step(1),
      ArrowLeft: () => record.step(-1),
      Home: () => record.look(0),
      End: () => record.look(null),
    }[event.key];
    if (!act) return;
    event.preventDefault();  // nor does the button with the focus take the space
    act();
  }
  press(button) { if (button.disabled) say(`not done: ${button.title}`); else button.click(); }
}

let saidUntil;
/// An answer, over the page: nothing moves for it.
function say(text) {
  $('said').textContent = text;
  clearTimeout(saidUntil);
  saidUntil = setTimeout(() => { $('said').textContent = ''; }, kSaidStays_ms);
}
