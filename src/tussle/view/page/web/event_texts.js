// Sentences for events: the same as in tussle/event_texts.py; a test compares the two.

/** Sentences of each kind of event. @type {Record<string, string[]>} */
export const EVENT_TEXTS = {
  "alarm": [
    "near failure: {text}"
  ],
  "birth": [
    "{id} was born"
  ],
  "capture": [
    "{id} captured {other}"
  ],
  "collision": [
    "{id} and {other} collided",
    "{id} hit the {text}",
    "{id} hit the ground"
  ],
  "death": [
    "{id} died: {text} ({other})",
    "{id} died: {text}",
    "{id} died ({other})",
    "{id} died"
  ],
  "difference": [
    "the two runs differ from here on"
  ],
  "failure": [
    "failed: {text}"
  ],
  "flag": [
    "{id} {text}"
  ],
  "mark": [
    "{text}"
  ],
  "end": [
    "the game ended: {text}"
  ]
};

/** Text for each reason for which a game ends. @type {Record<string, string>} */
export const END_TEXTS = {
  "time": "end time reached",
  "one_team": "one team is left",
  "all_dead": "no entity is left",
  "error": "a plugin failed",
  "": "interrupted"
};
