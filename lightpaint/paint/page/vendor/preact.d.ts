// What is used of preact.js, for `tsc --checkJs`.
export type Node = any;
export type Ref<T> = { current: T };
export function html(strings: TemplateStringsArray, ...values: any[]): Node;
export function render(tree: Node, parent: Element | DocumentFragment): void;
export class Component<P = any, S = any> {
  constructor(props: P);
  props: P;
  state: S;
  setState(changes: Partial<S>): void;
  forceUpdate(): void;
}
export function createContext<T>(value: T): { Provider: any };
export function useContext<T>(context: { Provider: any }): any;
export function useState<T>(first: T | (() => T)): [T, (next: T | ((last: T) => T)) => void];
export function useReducer<T, A>(step: (last: T, action: A) => T, first: T): [T, (action: A) => void];
export function useEffect(run: () => void | (() => void), on?: unknown[]): void;
export function useLayoutEffect(run: () => void | (() => void), on?: unknown[]): void;
export function useRef<T>(first: T): Ref<T>;
export function useMemo<T>(make: () => T, on: unknown[]): T;
export function useCallback<T extends Function>(run: T, on: unknown[]): T;
