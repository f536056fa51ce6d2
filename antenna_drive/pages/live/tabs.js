// Tabs as the keyboard expects them: arrows move between them.
export function makeTabs(list) {
  const tabs = [...list.querySelectorAll('[role="tab"]')];
  const panel = tab => document.getElementById(tab.getAttribute('aria-controls'));
  function choose(chosen) {
    for (const tab of tabs) {
      tab.setAttribute('aria-selected', String(tab === chosen));
      tab.tabIndex = tab === chosen ? 0 : -1;
      panel(tab).hidden = tab !== chosen;
    }
    dispatchEvent(new Event('resize'));
  }
  tabs.forEach((tab, place) => {
    tab.addEventListener('click', () => choose(tab));
    tab.addEventListener('keydown', event => {
      const step = {ArrowRight: 1, ArrowLeft: -1}[event.key];
      if (!step) return;
      const next = tabs[(place + step + tabs.length) % tabs.length];
      choose(next);
      next.focus();
    });
  });
}
