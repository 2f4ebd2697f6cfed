/* What the sketch takes of an Arduino core, declared only: the emulated board of board.cpp defines it. */
#ifndef ARDUINO_STUB_H
#define ARDUINO_STUB_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define HIGH 1
#define LOW 0
#define INPUT 0
#define OUTPUT 1
#define F(text) (text)

extern "C" {
void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t level);
int digitalRead(uint8_t pin);
unsigned long micros(void);
void delay(unsigned long ms);
void delayMicroseconds(unsigned int us);
}

class SerialPort {
  public:
    void begin(unsigned long baud);
    operator bool();
    void print(const char *text);
    void print(char letter);
    void print(long number);
    void print(unsigned long number);
    void print(double number, int digits);
    void println(const char *text);
    void println(unsigned long number);
    void println();
};
extern SerialPort Serial;

void setup();
void loop();

#endif
