// The file lists that the build fills into the service worker: [name, bytes, integrity].
type Listed = [name: string, bytes: number, integrity: string];
declare const __FILES__: Listed[];
declare const __RUNTIME__: Listed[];
declare const __IMMUTABLE__: string[];

/** One of Python's files, as the page lists it. */
interface RuntimeFile {
  name: string;
  size: number;
  sha256: string;
  holds?: string[];
}

/** Called with the number of bytes as they arrive. */
type Count = (bytes: number) => void;

/** The part of Pyodide's file system that is used. */
interface FileSystem {
  mkdirTree(path: string): void;
  writeFile(path: string, bytes: Uint8Array, options: { canOwn: boolean }): void;
}

/** The part of Pyodide that is used. */
interface Pyodide {
  runPython(code: string): any;
  pyimport(name: string): { destroy(): void };
  FS: FileSystem;
  _module: { HEAPU8: Uint8Array; libraries?: Record<string, WebAssembly.Module> };
}

/** Python's later files: which one an answer failed for want of, and how to load it. */
interface Rooms {
  wanted(): RuntimeFile | undefined;
  bring(file: RuntimeFile): Promise<unknown>;
}

/** The host's methods. */
type Answers = Record<"frame" | "job" | "give" | "forget", (request: string, data?: Uint8Array) => string>;

interface Start {
  runtime: string;
  files: RuntimeFile[];
  again?: boolean;
  known?: boolean;
  modules?: string[];
}

interface Question {
  type: "frame" | "job" | "give";
  id: number;
  request: string;
  data?: Uint8Array;
}
