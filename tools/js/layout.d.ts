// The module that livebass/web/layout.py makes: how the kernels are laid out.
interface RecordLayout {
  bytes: number;
  fields: Record<string, [offset: number, kind: string]>;
}
export const LAYOUT: {
  records: Record<string, RecordLayout>;
  numbers: Record<string, number>;
  called: string[];
  ways: Record<string, [action: number, field: string, ofChannel: boolean]>;
};
