/* Start of a Cortex-M4 with a unit for floats: its vectors, and the unit switched on before anything else. */
extern void _start(void);
extern char stack_top[];

static void reset(void)
{
  *(volatile unsigned long *)0xE000ED88UL |= 0xFUL << 20;
  __asm volatile("dsb\n\tisb");
  _start();
}

static void stop(void)
{
  for (;;) {
  }
}

struct vectors {
  char *stack;
  void (*handlers[15])(void);
};

__attribute__((section(".vectors"), used)) static const struct vectors vectors = {
  stack_top,
  { reset, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop },
};
