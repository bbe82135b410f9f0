/** Types of the data that the page receives and passes between its modules. Checked by tsc; never sent to a browser. */

/** x, y, z [m], east north up. */
export type Vector = ArrayLike<number>;
export type Colour = ArrayLike<number>;
/** Numbers of the corners of triangles, and the corners. */
export interface Mesh { vertices: number[]; faces: number[]; }
export interface Team { id: number; name: string; colour: number[]; }
export interface Block { name: string; team: number; colour: number[]; model: string; lengths: number[]; views: FieldOfView[]; }
/** What a plugin sees: full angles [degrees], of a cone where there is no elevation; range [m], or none; place and attitude on the body. */
export interface FieldOfView { plugin: string; azimuth: number; elevation: number | null; range: number | null; pos: number[]; quat: number[]; }
/** A column of plugins that was recorded: a component per field, or one without fields. */
export interface Column { name: string; kind: 'float' | 'int' | 'bool'; fields: string[]; units: string[]; doc: string; }
/** Title, and names, values and descriptions. */
export type Section = [string, [string, string, string?][]];
/** Changes of a quantity of a team, an entity or the world; null where it is not known. */
export interface Change { name: string; team: number | null; id: number; from: number; t: number[]; v: (number | null)[]; }
export interface GameEvent { t: number; kind: string; id: number; other: number; text: string; }
export type EventRow = [t: number, kind: string, id: number, other: number, text: string];

export interface Terrain { x: number[]; y: number[]; low: number; step: number; hasTexture: boolean; }
export interface SceneryData {
  /** Latitude and longitude [degrees] and height above the ellipsoid [m]; null without an origin. */
  origin: number[] | null;
  low: number[]; high: number[]; ground: number; hasGround: boolean; gridStep: number; originLength: number; background: number[] | null;
  bases: { team: number; pos: number[]; radius: number; opacity: number }[];
  regions: { name: string; team: number | null; isWall: boolean; mesh: Mesh; outline: number[]; nParts: number }[];
  terrain: Terrain | null;
}

/** The document: what the page is told at once, see document.py, recorded.py and publisher.py. */
export interface PageData {
  source: 'embedded' | 'range' | 'socket' | 'framed' | 'framedLive'; generator: string; title: string; blocks: Block[]; teams: Team[]; models: Record<string, Mesh>;
  scenery: SceneryData; opening: { position: number[] | null; target: number[] | null; mode: Mode; follow: number } | null;
  reach: number; scale: number; hasTrails: boolean; notes: string[]; facts: [string, string][]; idShift: number;
  isComplete: boolean; attitudeUnit: number; healthSteps: number;
  // Of a recorded run.
  nFrames?: number; nStates?: number; nEntities?: number[]; mostAtOnce?: number; chunks?: [number, number][]; positionError?: number;
  angleError?: number; begins?: number; runs?: { name: string; title: string; teams: number[]; teamShift: number }[]; shift?: Vector; signs?: [string, Vector][]; differing?: [string, string, string][]; quantities?: [string, string][];
  warp?: number | null; isPlaying?: boolean; lead?: string; shapeFrames?: number; columns?: Column[]; alarms?: SpecificationCourse[];
  // Of a live game.
  seed?: number; endTime?: number | null; dt?: number;
}

/** State of a live game, sent four times a second. */
export interface Status {
  t: number; step: number; span: [number, number]; epoch: number; seed: number; isPaused: boolean; isOver: boolean; isSeeking: boolean;
  warp: number | null; reached: number; rate: number; notes: string[]; error: string | null; metrics: [string, string][];
  events: { from: number; rows: EventRow[] }; refusal: string | null; isDriveRefused: boolean; steers: boolean; role: { kind: 'direct' | 'operate' | 'watch'; team: number | null; name: string };
  /** Topic, messages a second of the game, and the last message; null where it was not asked for. */
  feed: [string, number, string][] | null;
  alarms: SpecificationState[];
  entity: { id: number; sections: Section[]; quantities: [string, string][]; orders: OrderKind[]; axes: Record<string, string[]>; isDriven: boolean } | null;
}

/** How far a game is from breaking a specification, see alarms.py; null where a number is not known. */
export interface SpecificationState {
  id?: number; text: string; unit: string; state: 'holds' | 'near' | 'failed' | 'open' | 'unknown'; now: number | null; ended: number | null; least: number | null; reached: number | null;
  since: number | null; note: string;
}

/** What a specification came to in a recorded run, see alarms.py; `id` is that of its curve. */
export interface SpecificationCourse {
  id: number; text: string; unit: string; near: number | null; failed: number | null; t: number[]; least: (number | null)[]; note: string;
}

/** A field of an order: components by name, or a single value; their units. */
export interface OrderField {
  name: string; kind: 'number' | 'whole' | 'flag' | 'entity' | 'text'; parts: string[]; units: string[]; is_list: boolean; doc: string; example: number[];
}
/** A message that plugins of an entity take, see orders.py. */
export interface OrderKind { network: string; topic: string; message: string; plugins: string[]; doc: string; fields: OrderField[]; }

/** Shapes of plugins, see drawing.py. */
export interface ShapesHeader {
  parts: { kind: string; n: number; at: number; nVertices?: number; nFaces?: number }[]; texts: [string, number, number, number][]; width: number; notes?: string[];
}

export interface Source {
  isLive: boolean;
  blob(name: string): Promise<Uint8Array<ArrayBuffer>>;
  connect?(hear: MessageHandlers): void;
  send?(command: string, fields?: object): void;
}
export interface MessageHandlers {
  status(status: Status): void; curves(message: { results: string[]; changes: Change[] }): void; frame(header: { epoch: number }, bytes: Uint8Array): void; lost(): void;
  past(header: { epoch: number; seconds: number }, bytes: Uint8Array): void; drawn(header: ShapesHeader, bytes: Uint8Array): void;
}

export type Mode = 'overview' | 'follow' | 'behind' | 'free';
/** What a picture is drawn from, see `Camera.view`. */
export interface View {
  clip: Float64Array; eye: number[]; right: number[]; up: number[]; away: number[]; width: number; height: number; anchor: Vector;
  near: number; far: number; distance: number; perPixel: number; ratio: number;
}
/** Entities at a time. */
export interface Sample { t: number; ids(): Iterable<number>; placeOf(id: number): number[] | null; }
/** What is drawn and how, as the settings have it. */
export interface Drawn {
  scale: number; trail: number; text: number; labels: boolean; names: boolean; wire: boolean; least: boolean; grid: boolean; regions: boolean; shapes: boolean;
  rings: boolean; cones: boolean; links: boolean; ringRadius: number; coneRange: number; coneAngle: number; linkRange: number;
}
