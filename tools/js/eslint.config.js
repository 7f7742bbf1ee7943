// What eslint asks of the page's scripts. Types, and names that nobody declared, are tsc's.
import js from "@eslint/js";

export default [
  js.configs.recommended,
  {
    linterOptions: {reportUnusedDisableDirectives: "error"},
    rules: {
      "eqeqeq": "error",
      "no-undef": "off",
      "no-implicit-globals": "error",
      "no-shadow-restricted-names": "error",
      "no-unused-vars": ["error", {args: "after-used"}],
      "no-use-before-define": ["error", {functions: false, classes: false, variables: false}],
      "no-var": "error",
      "prefer-const": "error",
      "require-atomic-updates": "error",
    },
  },
];
