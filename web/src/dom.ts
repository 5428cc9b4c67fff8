// The elements of `page.html`.
export const byId = <E extends HTMLElement>(id: string): E => document.getElementById(id) as E;
